"""A scene with fewer triangles, in which no deviation and no part has disappeared."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import fast_simplification
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from meshcone.quality.parts import Partition
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, Ints, row_dot
from meshcone.views.scene import Scene, Surface

_Number = TypeVar("_Number", np.float64, np.int64)


@dataclass(frozen=True)
class Light:
    """A scene with fewer triangles.

    Attributes:
        scene: what is left.
        ours: how source and refined mesh were made lighter.
        theirs: how the reference was.
    """

    scene: Scene
    ours: Collapse
    theirs: Collapse


def simplified(scene: Scene, most_faces: int) -> Light:
    """The scene with meshes of at most about ``most_faces`` triangles.

    Input and refined mesh lose the same vertices, so that they can be laid over each other. A
    vertex that stands for several shows the largest value of them: no deviation disappears.
    """
    leading = scene.refined or scene.input
    ours = Collapse.of(leading.mesh, most_faces)
    theirs = Collapse.of(scene.reference.mesh, most_faces)
    parts = scene.parts
    light = replace(
        scene,
        input=ours.of_surface(scene.input),
        refined=None if scene.refined is None else ours.of_surface(scene.refined),
        reference=theirs.of_surface(scene.reference),
        tension=None if scene.tension is None else ours.largest(scene.tension),
        parts=None if parts is None else (ours.of_parts(parts[0]), theirs.of_parts(parts[1])),
    )
    return Light(light, ours, theirs)


@dataclass(frozen=True)
class Collapse:
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
    def of(cls, mesh: Mesh, most_faces: int) -> Collapse:
        """Find collapses after which a mesh has at most about ``most_faces`` triangles."""
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

    def of_coordinates(self, coordinates: Floats, vertices: Floats) -> Floats:
        """Texture coordinates (k, 3, 2) of the corners of the faces left.

        Among the corners that a vertex stands for, it takes the coordinates of the one closest to
        it, separately on each side of a seam: no triangle reaches over one.

        Args:
            coordinates: (m, 3, 2) of the corners of all faces.
            vertices: (v, 3) where the vertices left are now.
        """
        if self.collapses is None:
            return coordinates
        corners = self.mesh.faces.ravel()
        becomes = self.target[corners]
        group = self._groups(_wedges(self.mesh.faces, coordinates))
        moves = self.mesh.vertices[corners] - vertices[np.maximum(becomes, 0)]
        order = np.lexsort((row_dot(moves, moves), group))
        closest = np.empty(int(group.max(initial=-1)) + 1, dtype=np.int64)
        closest[group[order[::-1]]] = order[::-1]
        return np.asarray(coordinates.reshape(-1, 2)[closest[group]].reshape(-1, 3, 2)[self._kept])

    def _groups(self, wedges: Ints) -> Ints:
        """(3m,) groups of corners that have become one vertex and are on one side of a seam.

        Two wedges are in one group where an edge between them has collapsed.
        """
        ends = np.stack([wedges, np.roll(wedges, -1, axis=1)]).reshape(2, -1)
        becomes = self.target[self.mesh.faces]
        collapsed = (becomes == np.roll(becomes, -1, axis=1)).ravel()
        count = int(wedges.max(initial=-1)) + 1
        ends = ends[:, collapsed]
        graph = coo_matrix((np.ones(ends.shape[1], dtype=bool), ends), shape=(count, count))
        _, groups = connected_components(graph, directed=False)
        return np.asarray(groups[wedges.ravel()], dtype=np.int64)

    @property
    def _kept(self) -> NDArray[np.bool_]:
        """(m,) which faces are left: those whose corners have become three vertices."""
        a, b, c = self.target[self.mesh.faces].T
        there = (a >= 0) & (b >= 0) & (c >= 0)
        return np.asarray(there & (a != b) & (b != c) & (c != a))

    def of_parts(self, partition: Partition) -> Partition:
        """Which part each face left is of: that of two of its corners, where they agree."""
        if self.collapses is None:
            return partition
        of_vertex = np.zeros(int(self.target.max(initial=-1)) + 1, dtype=np.int64)
        corners = self.target[self.mesh.faces.ravel()]
        there = corners >= 0
        of_vertex[corners[there]] = np.repeat(partition.labels, 3)[there]
        return Partition(partition.names, np.sort(of_vertex[self.left], axis=1)[:, 1])


def _wedges(faces: Ints, coordinates: Floats) -> Ints:
    """A number (m, 3) for each vertex with coordinates of its own at the corners (m, 3, 2)."""
    corners = coordinates.reshape(-1, 2)
    order = np.lexsort((corners[:, 1], corners[:, 0], faces.ravel()))
    rows = np.column_stack([faces.ravel(), corners])[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    numbers = np.empty(len(order), dtype=np.int64)
    numbers[order] = np.cumsum(new) - 1
    return numbers.reshape(-1, 3)


def _writable(array: NDArray[_Number]) -> NDArray[_Number]:
    """A copy; the library's binding takes no array that is read-only."""
    return np.array(array)
