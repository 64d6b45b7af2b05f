"""A writer for small GLB files: one node, one mesh, a primitive for each material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.builder import GlbBuilder

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """A plain metallic-roughness material; the colour is linear RGB in [0, 1]."""

    name: str
    colour: Colour
    metallic: float
    roughness: float


@dataclass(frozen=True)
class Patch:
    """A textured piece of surface, split at its seams.

    Attributes:
        positions: (r, 3) in the node's own space.
        normals: (r, 3) unit vectors.
        uv: (r, 2) texture coordinates.
        triangles: (k, 3) indices below 65,535, counter-clockwise seen from outside.
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    uv: NDArray[np.float64]
    triangles: NDArray[np.int64]


@dataclass(frozen=True)
class Placement:
    """Where the node puts its mesh: scaled, then rotated, then translated.

    Attributes:
        translation: in model units.
        rotation: unit quaternion x, y, z, w.
        scale: the same along all axes.
    """

    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    scale: float


def write_glb(name: str, parts: Sequence[tuple[Patch, Material]], placement: Placement) -> bytes:
    """Write a GLB file whose one mesh has a primitive for each part."""
    builder = GlbBuilder()
    primitives = [
        {
            "attributes": {
                "POSITION": builder.add_vectors(patch.positions, bounds=True),
                "NORMAL": builder.add_vectors(patch.normals),
                "TEXCOORD_0": builder.add_vectors(patch.uv),
            },
            "indices": builder.add_indices(patch.triangles),
            "material": number,
        }
        for number, (patch, _) in enumerate(parts)
    ]
    document = {
        "asset": {"version": "2.0", "generator": "MeshCone demo"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {
                "name": name,
                "mesh": 0,
                "translation": placement.translation,
                "rotation": placement.rotation,
                "scale": [placement.scale] * 3,
            }
        ],
        "meshes": [{"name": name, "primitives": primitives}],
        "materials": [_material(material) for _, material in parts],
    }
    return builder.finish(document)


def _material(material: Material) -> dict[str, Any]:
    return {
        "name": material.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*material.colour, 1.0],
            "metallicFactor": material.metallic,
            "roughnessFactor": material.roughness,
        },
    }
