"""Normals and tangents that are no directions: they stay as they are, and no file is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meshcone.assets import read_asset
from tests.unit.assets.builders import Gltf, chunks, cube_gltf, split_cube
from tests.unit.assets.plain_gltf import table

_, NORMALS, _ = split_cube()
TANGENTS = np.column_stack([np.roll(NORMALS, 1, axis=1), np.ones(24)])


def shaded(normals: NDArray[Any], tangents: NDArray[Any]) -> Gltf:
    """A cube with normals and tangents of the caller's, which may be integers."""
    gltf = cube_gltf()
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    for name, values in (("NORMAL", normals), ("TANGENT", tangents)):
        integers = values.dtype.kind != "f"
        attributes[name] = gltf.accessor(values, **({"normalized": True} if integers else {}))
    gltf.json["extensionsUsed"] = ["KHR_mesh_quantization"]
    for accessor in gltf.json["accessors"][4:]:  # JSON has no word for what is not finite
        del accessor["min"], accessor["max"]
    return gltf


def sheared(gltf: Gltf) -> bytes:
    """The file with all its vertices moved, so that every normal and tangent is due."""
    asset = read_asset("mesh.glb", gltf.glb())
    shear = np.array([[1, 0.2, 0], [0, 1, 0.3], [0.1, 0, 1]])
    return asset.patched(asset.vertices @ shear)


def attribute(glb: bytes, name: str) -> NDArray[Any]:
    return table(glb, chunks(glb)[0]["meshes"][0]["primitives"][0]["attributes"][name])


@pytest.mark.parametrize(
    "broken",
    [[np.nan, np.nan, np.nan, 1], [np.inf, 0, 0, 1], [0, -np.inf, 0, -1], [1, 0, 0, np.nan]],
)
@pytest.mark.filterwarnings("error")
def test_a_tangent_that_is_not_finite_stays_and_the_others_turn(broken: list[float]) -> None:
    tangents = TANGENTS.astype(np.float32)
    tangents[3] = broken
    after = sheared(shaded(NORMALS, tangents))
    assert attribute(after, "TANGENT")[3].tobytes() == tangents[3].tobytes()
    turned = attribute(after, "TANGENT") != tangents
    assert np.delete(turned.any(axis=1), 3).all()


@pytest.mark.parametrize("broken", [np.nan, np.inf, -np.inf])
@pytest.mark.filterwarnings("error")
def test_a_normal_that_is_not_finite_stays_with_its_tangent(broken: float) -> None:
    normals, tangents = NORMALS.copy(), TANGENTS.astype(np.float32)
    normals[3, 1] = broken
    after = sheared(shaded(normals, tangents))
    assert attribute(after, "NORMAL")[3].tobytes() == normals[3].tobytes()
    assert attribute(after, "TANGENT")[3].tobytes() == tangents[3].tobytes()


@pytest.mark.parametrize("dtype", ["i1", "i2"])
def test_an_integer_tangent_without_a_direction_keeps_its_bytes(dtype: str) -> None:
    tangents = (TANGENTS * np.iinfo(dtype).max).astype(dtype)
    tangents[3] = 0, 0, 0, np.iinfo(dtype).min  # a step past -1, which reads as -1
    normals = (NORMALS * np.iinfo(dtype).max).astype(dtype)
    gltf = shaded(normals, tangents)
    after = sheared(gltf)
    assert attribute(after, "TANGENT")[3].tolist() == tangents[3].tolist()
    assert (attribute(after, "TANGENT") != tangents).any()
