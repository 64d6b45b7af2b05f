"""Two triangles whose sides tests split, and what should lie there afterwards."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets import read_asset
from meshcone.surface import Subdivision
from tests.unit.assets.bisecting import bisected
from tests.unit.assets.builders import Gltf

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float32)
TWO = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint16)


def square(**attributes: NDArray[Any]) -> Gltf:
    """Two triangles with attributes of the caller's, which have views of their own."""
    gltf = Gltf()
    named = {"POSITION": gltf.accessor(SQUARE)}
    for name, values in attributes.items():
        integers = values.dtype.kind != "f" and not name.startswith(("JOINTS", "_"))
        named[name] = gltf.accessor(values, **({"normalized": True} if integers else {}))
    primitive = {"attributes": named, "indices": gltf.accessor(TWO.reshape(-1))}
    gltf.node(mesh=gltf.mesh(primitive))
    return gltf


def divided(glb: bytes, picks: list[int]) -> tuple[bytes, Subdivision]:
    """A file with sides of its triangles split, and how."""
    asset = read_asset("a.glb", glb)
    subdivision = bisected(asset.faces, picks)
    return asset.divided(subdivision), subdivision


def between(values: NDArray[np.float64], subdivision: Subdivision) -> NDArray[np.float64]:
    """(f, 3, c) what lies at the corners of children, of (m, 3, c) at those of parents."""
    weights = subdivision.corners / 2.0**subdivision.exponent
    return np.einsum("fij,fjc->fic", weights, values[subdivision.parents])
