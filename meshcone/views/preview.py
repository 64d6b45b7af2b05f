"""A light copy of a scene, for a browser to show: one GLB file.

It has a node for each of ``input``, ``refined`` and ``reference``, in the frame, so that single
precision is enough wherever the model lies. Vertices carry attributes of our own (glTF 2.0,
section 3.7.2.1, lets them begin with an underscore): ``_DEVIATION``, and ``_TENSION`` where
there are multipliers. ``asset.extras`` leads back to model units.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, TypeVar

import fast_simplification
import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.builder import GlbBuilder
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, Ints
from meshcone.views.scene import Scene, Surface

PREVIEW_FACES = 100_000

_Number = TypeVar("_Number", np.float64, np.int64)


def preview_glb(scene: Scene, most_faces: int = PREVIEW_FACES) -> bytes:
    """Write a scene as a GLB file whose meshes have at most about ``most_faces`` triangles.

    Input and refined mesh lose the same vertices, so that they can be laid over each other. A
    vertex that stands for several shows the largest value of them: no deviation disappears.
    """
    light = simplified(scene, most_faces)
    builder = GlbBuilder()
    meshes: list[dict[str, Any]] = []
    faces = builder.add_indices(light.input.mesh.faces)
    for name, surface in (("input", light.input), ("refined", light.refined)):
        if surface is not None:
            tension = light.tension if name == "refined" else None
            meshes.append(_mesh(builder, name, surface, faces, tension))
    faces = builder.add_indices(light.reference.mesh.faces)
    meshes.append(_mesh(builder, "reference", light.reference, faces, None))
    return builder.finish(
        {
            "asset": {"version": "2.0", "generator": "MeshCone", "extras": _extras(scene)},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(meshes)))}],
            "nodes": [{"name": mesh["name"], "mesh": number} for number, mesh in enumerate(meshes)],
            "meshes": meshes,
        }
    )


def simplified(scene: Scene, most_faces: int) -> Scene:
    """The scene with meshes of at most about ``most_faces`` triangles."""
    leading = scene.refined or scene.input
    collapse = _Collapse.of(leading.mesh, most_faces)
    return replace(
        scene,
        input=collapse.of_surface(scene.input),
        refined=None if scene.refined is None else collapse.of_surface(scene.refined),
        reference=_Collapse.of(scene.reference.mesh, most_faces).of_surface(scene.reference),
        tension=None if scene.tension is None else collapse.largest(scene.tension),
    )


@dataclass(frozen=True)
class _Collapse:
    """A sequence of edge collapses (Garland and Heckbert 1997) that can be done again.

    Attributes:
        faces: (m, 3) of the mesh it was found on.
        collapses: as ``fast_simplification`` records them; None where nothing is collapsed.
        target: (n,) which vertex each one has become.
    """

    faces: Ints
    collapses: Ints | None
    target: Ints

    @classmethod
    def of(cls, mesh: Mesh, most_faces: int) -> _Collapse:
        if len(mesh.faces) <= most_faces:
            return cls(mesh.faces, None, np.arange(len(mesh.vertices)))
        vertices, faces = _writable(mesh.vertices), _writable(mesh.faces)
        *_, collapses = fast_simplification.simplify(
            vertices, faces, target_count=most_faces, return_collapses=True
        )
        *_, target = fast_simplification.replay_simplification(vertices, faces, collapses)
        return cls(faces, collapses, np.asarray(target, dtype=np.int64))

    def of_surface(self, surface: Surface) -> Surface:
        """The surface, over the same faces, after the collapses."""
        if self.collapses is None:
            return surface
        vertices, faces, _ = fast_simplification.replay_simplification(
            _writable(surface.mesh.vertices), self.faces, self.collapses
        )
        return Surface(Mesh(vertices, faces), self.largest(surface.deviation))

    def largest(self, values: Floats) -> Floats:
        """The largest of the values (n,) that each vertex left now stands for."""
        kept = np.zeros(int(self.target.max(initial=-1)) + 1)
        there = self.target >= 0
        np.maximum.at(kept, self.target[there], values[there])
        return kept


def _writable(array: NDArray[_Number]) -> NDArray[_Number]:
    """A copy; the library's binding takes no array that is read-only."""
    return np.array(array)


def _mesh(
    builder: GlbBuilder, name: str, surface: Surface, faces: int, tension: Floats | None
) -> dict[str, Any]:
    attributes = {
        "POSITION": builder.add_vectors(surface.mesh.vertices, bounds=True),
        "_DEVIATION": builder.add_vectors(surface.deviation),
    }
    if tension is not None:
        attributes["_TENSION"] = builder.add_vectors(tension)
    return {"name": name, "primitives": [{"attributes": attributes, "indices": faces}]}


def _extras(scene: Scene) -> dict[str, Any]:
    surfaces = {"input": scene.input, "refined": scene.refined, "reference": scene.reference}
    return {
        "centre": scene.frame.centre.tolist(),
        "radius": scene.frame.radius,
        "faces": {name: len(each.mesh.faces) for name, each in surfaces.items() if each},
    }
