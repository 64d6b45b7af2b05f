"""A reader of glTF for tests: what the corners of each triangle have, and nothing else."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.unit.assets.builders import chunks

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def table(glb: bytes, index: int) -> NDArray[Any]:
    """(count, columns) components of an accessor, as they are stored."""
    document, binary = chunks(glb)
    accessor = document["accessors"][index]
    dtype, columns = np.dtype(_TYPES[accessor["componentType"]]), _COLUMNS[accessor["type"]]

    def read(part: dict[str, Any], kind: np.dtype[Any], count: int, wide: int) -> NDArray[Any]:
        view = document["bufferViews"][part["bufferView"]]
        start = view.get("byteOffset", 0) + part.get("byteOffset", 0)
        stride = view.get("byteStride", kind.itemsize * wide)
        return np.ndarray((count, wide), kind, binary, start, (stride, kind.itemsize)).copy()

    values = np.zeros((accessor["count"], columns), dtype)
    if "bufferView" in accessor:
        values = read(accessor, dtype, accessor["count"], columns)
    if "sparse" in accessor:
        sparse = accessor["sparse"]
        kind = np.dtype(_TYPES[sparse["indices"]["componentType"]])
        rows = read(sparse["indices"], kind, sparse["count"], 1)[:, 0]
        values[rows] = read(sparse["values"], dtype, sparse["count"], columns)
    return values


def numbers(glb: bytes, index: int) -> NDArray[np.float64]:
    """The same as the numbers that they stand for."""
    values = table(glb, index)
    if not chunks(glb)[0]["accessors"][index].get("normalized"):
        return values.astype(np.float64)
    return np.maximum(values / float(np.iinfo(values.dtype).max), -1)


def triangles(glb: bytes, mesh: int = 0, primitive: int = 0) -> NDArray[np.int64]:
    """(k, 3) vertices of a primitive's triangles; those of a strip may be none."""
    drawn = chunks(glb)[0]["meshes"][mesh]["primitives"][primitive]
    if "indices" in drawn:
        order = table(glb, drawn["indices"])[:, 0].astype(np.int64)
    else:
        order = np.arange(len(table(glb, drawn["attributes"]["POSITION"])))
    if drawn.get("mode", 4) == 4:
        return order.reshape(-1, 3)
    if drawn["mode"] == 6:
        return np.array([(order[0], *pair) for pair in pairwise(order[1:])])
    strip = list(zip(order, order[1:], order[2:], strict=False))
    return np.array([(a, c, b) if odd % 2 else (a, b, c) for odd, (a, b, c) in enumerate(strip)])


def corners(
    glb: bytes, name: str, mesh: int = 0, primitive: int = 0, target: int | None = None
) -> NDArray[np.float64]:
    """(k, 3, c) values of an attribute at the corners of a primitive's triangles."""
    drawn = chunks(glb)[0]["meshes"][mesh]["primitives"][primitive]
    names = drawn["attributes"] if target is None else drawn["targets"][target]
    return numbers(glb, names[name])[triangles(glb, mesh, primitive)]
