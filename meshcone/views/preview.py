"""A light copy of a scene, for a browser to show: one GLB file.

It has a node for each of ``input``, ``refined`` and ``reference``, in the frame, so that single
precision is enough wherever the model lies. Vertices carry attributes of our own (glTF 2.0,
section 3.7.2.1, lets them begin with an underscore): ``_DEVIATION``; ``_SIGNED``, which is
negative inside a reference that has an inside; ``_TENSION`` where there are multipliers.
``asset.extras`` leads back to model units.

``extras`` of a mesh have what belongs to its triangles: ``parts``, each with a name, the first of
its triangles and their number; ``skin``, the image of all its colours and an accessor of the
texels (column, row) of every corner; ``uv``, an accessor of every corner's texture coordinates
between ``low`` and ``high``; ``contrast``, on the mesh that is judged, how different its colours
are from the reference's: an image whose brightest value stands for a CIEDE2000 of ``top``, and
texels as those of a skin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from meshcone.appearance.comparison import comparable
from meshcone.appearance.paint import Paint
from meshcone.assets.gltf.builder import GlbBuilder
from meshcone.quality.directions import inside
from meshcone.quality.parts import Partition
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, Ints
from meshcone.views.light import Collapse, simplified
from meshcone.views.scene import Scene, Surface
from meshcone.views.skin import Origin, contrast_of, skin_of

PREVIEW_FACES = 100_000
_TEXELS = 10  # of the skin for each triangle that a preview may have
_CONTRAST_SIDE = 512  # texels at least: as many points of the surface are compared
_STEPS = np.iinfo(np.uint16).max


def preview_glb(scene: Scene, most_faces: int = PREVIEW_FACES) -> bytes:
    """Write a scene as a GLB file whose meshes have at most about ``most_faces`` triangles.

    :func:`meshcone.views.light.simplified` says what becomes of the others.
    """
    lighter = simplified(scene, most_faces)
    light = lighter.scene
    side = 1 << round(np.log2(most_faces * _TEXELS) / 2)
    parts = light.parts or (None, None)
    paints = scene.paints or (None, None)
    leading = scene.refined or scene.input
    shown = light.refined or light.input
    builder = _Builder(GlbBuilder(), [], side)
    ours = builder.triangles(shown.mesh, parts[0], paints[0], leading.mesh, lighter.ours)
    meshes = [builder.mesh("input", light.input, ours, signed=_signed(light, light.input))]
    if light.refined is not None:
        signed = _signed(light, light.refined)
        meshes.append(builder.mesh("refined", light.refined, ours, signed, light.tension))
    if scene.paints is not None and comparable(*scene.paints):
        order = _order(shown.mesh, parts[0])
        origin = _origin(shown.mesh, order, scene.paints[0], leading.mesh)
        against = (scene.reference.mesh, scene.paints[1])
        meshes[-1]["extras"] |= builder.contrast(_ordered(shown.mesh, order), origin, against)
    theirs = builder.triangles(
        light.reference.mesh, parts[1], paints[1], scene.reference.mesh, lighter.theirs
    )
    meshes.append(builder.mesh("reference", light.reference, theirs))
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "MeshCone", "extras": _extras(scene)},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(meshes)))}],
        "nodes": [{"name": mesh["name"], "mesh": number} for number, mesh in enumerate(meshes)],
        "meshes": meshes,
    }
    if builder.images:
        document["images"] = builder.images
    return builder.glb.finish(document)


def _signed(light: Scene, surface: Surface) -> Floats | None:
    """The deviation, negative inside the reference; None where that has no inside."""
    if light.closed is None:
        return None
    within = inside(surface.mesh.vertices, light.closed)
    return np.asarray(np.where(within, -1, 1) * surface.deviation)


@dataclass(frozen=True)
class _Triangles:
    """What surfaces over the same faces share: an accessor of them, and extras."""

    indices: int
    extras: dict[str, Any]


@dataclass(frozen=True)
class _Builder:
    """The file as it grows, its images, and the side of a skin in texels."""

    glb: GlbBuilder
    images: list[dict[str, Any]]
    side: int

    def triangles(
        self,
        mesh: Mesh,
        partition: Partition | None,
        paint: Paint | None,
        whole: Mesh,
        collapse: Collapse,
    ) -> _Triangles:
        """Add the faces of a surface, part after part, and what is known of each.

        Args:
            mesh: of at most about as many faces as were asked for.
            partition: its parts, if they are told apart.
            paint: the colours of ``whole``, if they were asked for.
            whole: the mesh of all faces that it was made of.
            collapse: how it was made of that.
        """
        order = _order(mesh, partition)
        extras: dict[str, Any] = {}
        if partition is not None:
            extras["parts"] = _ranges(partition)
        if paint is not None and paint.has_colour:
            origin = _origin(mesh, order, paint, whole)
            extras["skin"] = self._skin(_ordered(mesh, order), origin)
            coordinates = paint.coordinates(np.arange(len(whole.faces)))
            if coordinates is not None:
                left = collapse.of_coordinates(coordinates, mesh.vertices)
                extras["uv"] = self._uv(left[order])
        return _Triangles(self.glb.add_indices(mesh.faces[order]), extras)

    def _skin(self, mesh: Mesh, origin: Origin) -> dict[str, int]:
        least = _least_side(mesh)
        skin = skin_of(mesh, origin, max(self.side, least) if origin.paint.varies else least)
        self.images.append({"bufferView": self.glb.add_file(skin.image), "mimeType": "image/jpeg"})
        return {
            "image": len(self.images) - 1,
            "side": skin.side,
            "corners": self.glb.add_shorts(skin.corners.reshape(-1, 2)),
        }

    def contrast(self, mesh: Mesh, origin: Origin, theirs: tuple[Mesh, Paint]) -> dict[str, Any]:
        """Add how different the judged colours are; nothing where they are not known."""
        side = max(_least_side(mesh), _CONTRAST_SIDE)
        found = contrast_of(mesh, origin, theirs, side)
        if found is None:
            return {}
        self.images.append({"bufferView": self.glb.add_file(found.image), "mimeType": "image/png"})
        texels = self.glb.add_shorts(found.corners.reshape(-1, 2))
        seen = {"image": len(self.images) - 1, "side": side, "corners": texels, "top": found.top}
        return {"contrast": seen}

    def _uv(self, coordinates: Floats) -> dict[str, Any]:
        rows = coordinates.reshape(-1, 2)
        low, high = rows.min(axis=0), rows.max(axis=0)
        steps = np.rint(_STEPS * (rows - low) / np.maximum(high - low, 1e-12))
        corners = self.glb.add_shorts(steps.astype(np.uint16))
        return {"corners": corners, "low": low.tolist(), "high": high.tolist()}

    def mesh(
        self,
        name: str,
        surface: Surface,
        triangles: _Triangles,
        signed: Floats | None = None,
        tension: Floats | None = None,
    ) -> dict[str, Any]:
        """Add a surface with the values of its vertices."""
        attributes = {
            "POSITION": self.glb.add_vectors(surface.mesh.vertices, bounds=True),
            "_DEVIATION": self.glb.add_vectors(surface.deviation),
        }
        for key, values in (("_SIGNED", signed), ("_TENSION", tension)):
            if values is not None:
                attributes[key] = self.glb.add_vectors(values)
        primitive = {"attributes": attributes, "indices": triangles.indices}
        return {"name": name, "primitives": [primitive], "extras": dict(triangles.extras)}


def _order(mesh: Mesh, partition: Partition | None) -> Ints:
    """The faces (m,), part after part."""
    if partition is None:
        return np.arange(len(mesh.faces))
    return np.argsort(partition.labels, kind="stable")


def _ordered(mesh: Mesh, order: Ints) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces[order])


def _origin(mesh: Mesh, order: Ints, paint: Paint, whole: Mesh) -> Origin:
    """Where a mesh, its faces in an order, has its colours from."""
    return Origin(paint, order if len(mesh.faces) == len(whole.faces) else None, whole)


def _least_side(mesh: Mesh) -> int:
    """Of a picture in which the smallest patches have room, which are all that plain faces need."""
    return 1 << int(np.ceil(np.log2(8 * max(len(mesh.faces), 8)) / 2))


def _ranges(partition: Partition) -> list[dict[str, Any]]:
    """Where each part begins among the triangles in the order of parts; none without any."""
    counts = np.bincount(partition.labels, minlength=len(partition.names))
    begins = np.cumsum(counts) - counts
    return [
        {"name": name, "first": int(first), "count": int(count)}
        for name, first, count in zip(partition.names, begins, counts, strict=True)
        if count
    ]


def _extras(scene: Scene) -> dict[str, Any]:
    surfaces = {"input": scene.input, "refined": scene.refined, "reference": scene.reference}
    return {
        "centre": scene.frame.centre.tolist(),
        "radius": scene.frame.radius,
        "faces": {name: len(each.mesh.faces) for name, each in surfaces.items() if each},
    }
