"""A scene with fewer triangles, in which no deviation and no part has disappeared."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import fast_simplification
import numpy as np
from numpy.typing import NDArray

from meshcone.quality.parts import Partition
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, Ints
from meshcone.views.scene import Scene, Surface

_Number = TypeVar("_Number", np.float64, np.int64)


def simplified(scene: Scene, most_faces: int) -> Scene:
    """The scene with meshes of at most about ``most_faces`` triangles.

    Input and refined mesh lose the same vertices, so that they can be laid over each other. A
    vertex that stands for several shows the largest value of them: no deviation disappears.
    """
    leading = scene.refined or scene.input
    ours = _Collapse.of(leading.mesh, most_faces)
    theirs = _Collapse.of(scene.reference.mesh, most_faces)
    parts = scene.parts
    return replace(
        scene,
        input=ours.of_surface(scene.input),
        refined=None if scene.refined is None else ours.of_surface(scene.refined),
        reference=theirs.of_surface(scene.reference),
        tension=None if scene.tension is None else ours.largest(scene.tension),
        parts=None if parts is None else (ours.of_parts(parts[0]), theirs.of_parts(parts[1])),
    )


@dataclass(frozen=True)
class _Collapse:
    """A sequence of edge collapses (Garland and Heckbert 1997) that can be done again.

    Attributes:
        mesh: it was found on.
        collapses: as ``fast_simplification`` records them; None where nothing is collapsed.
        target: (n,) which vertex each one has become.
        left: (k, 3) the faces that are left.
    """

    mesh: Mesh
    collapses: Ints | None
    target: Ints
    left: Ints

    @classmethod
    def of(cls, mesh: Mesh, most_faces: int) -> _Collapse:
        if len(mesh.faces) <= most_faces:
            return cls(mesh, None, np.arange(len(mesh.vertices)), mesh.faces)
        vertices, faces = _writable(mesh.vertices), _writable(mesh.faces)
        *_, collapses = fast_simplification.simplify(
            vertices, faces, target_count=most_faces, return_collapses=True
        )
        _, left, target = fast_simplification.replay_simplification(vertices, faces, collapses)
        return cls(mesh, collapses, np.asarray(target, dtype=np.int64), left.astype(np.int64))

    def of_surface(self, surface: Surface) -> Surface:
        """The surface, over the same faces, after the collapses."""
        if self.collapses is None:
            return surface
        vertices, faces, _ = fast_simplification.replay_simplification(
            _writable(surface.mesh.vertices), _writable(self.mesh.faces), self.collapses
        )
        return Surface(Mesh(vertices, faces), self.largest(surface.deviation))

    def largest(self, values: Floats) -> Floats:
        """The largest of the values (n,) that each vertex left now stands for."""
        kept = np.zeros(int(self.target.max(initial=-1)) + 1)
        there = self.target >= 0
        np.maximum.at(kept, self.target[there], values[there])
        return kept

    def of_parts(self, partition: Partition) -> Partition:
        """Which part each face left is of: that of two of its corners, where they agree."""
        if self.collapses is None:
            return partition
        of_vertex = np.zeros(int(self.target.max(initial=-1)) + 1, dtype=np.int64)
        corners = self.target[self.mesh.faces.ravel()]
        there = corners >= 0
        of_vertex[corners[there]] = np.repeat(partition.labels, 3)[there]
        return Partition(partition.names, np.sort(of_vertex[self.left], axis=1)[:, 1])


def _writable(array: NDArray[_Number]) -> NDArray[_Number]:
    """A copy; the library's binding takes no array that is read-only."""
    return np.array(array)
