from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.quality.validity import inspect
from meshcone.surface import Frame, Mesh
from service.demo.asset import NOISE, degraded, face_colours, reference_glb

JSON_HEADER = 20  # bytes before a GLB file's JSON


@pytest.fixture(scope="module")
def reference() -> bytes:
    return reference_glb()


@pytest.fixture(scope="module")
def source(reference: bytes) -> bytes:
    return degraded(reference)


def surface(data: bytes) -> Mesh:
    asset = read_asset("jug.glb", data)
    return Mesh(asset.vertices, asset.faces)


def document(data: bytes) -> dict[str, Any]:
    (length,) = struct.unpack_from("<I", data, 12)
    parsed: dict[str, Any] = json.loads(data[JSON_HEADER : JSON_HEADER + length])
    return parsed


def values(data: bytes, number: int) -> np.ndarray:
    """The numbers an accessor describes, as the file's own view places them."""
    described = document(data)
    accessor = described["accessors"][number]
    view = described["bufferViews"][accessor["bufferView"]]
    (length,) = struct.unpack_from("<I", data, 12)
    start = JSON_HEADER + length + 8 + view["byteOffset"]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor["type"]]
    kind = {5123: "<u2", 5126: "<f4"}[accessor["componentType"]]
    return np.frombuffer(data, kind, accessor["count"] * width, start).reshape(-1, width)


def attribute(data: bytes, primitive: int, name: str) -> np.ndarray:
    return values(data, document(data)["meshes"][0]["primitives"][primitive]["attributes"][name])


def triangles(data: bytes, primitive: int) -> np.ndarray:
    indices = values(data, document(data)["meshes"][0]["primitives"][primitive]["indices"])
    return indices.reshape(-1, 3).astype(np.int64)


def test_jug_is_watertight_once_its_seams_are_welded(reference: bytes) -> None:
    validity = inspect(surface(reference), 100_000)
    assert validity.watertight
    assert validity.degenerate_faces == 0
    assert validity.components == 2


def test_jug_has_its_outside_out(reference: bytes) -> None:
    mesh = surface(reference)
    signed_volume = np.einsum("ij,ij->", mesh.corners[:, 0], mesh.doubled_area_vectors) / 6
    assert signed_volume > 0


def test_jug_has_seams_and_two_materials(reference: bytes) -> None:
    counts = read_asset("jug.glb", reference).counts()
    assert counts.materials == 2
    assert counts.meshes == 1
    assert counts.vertices > counts.welded_vertices


def test_jug_is_placed_by_its_node(reference: bytes) -> None:
    node = document(reference)["nodes"][0]
    assert node["scale"] != [1.0, 1.0, 1.0]
    assert np.linalg.norm(node["rotation"]) == pytest.approx(1)
    low, high = (edge(surface(reference).vertices, axis=0) for edge in (np.min, np.max))
    assert high[1] - low[1] == pytest.approx(0.24, abs=0.01)  # upright, in metres


@pytest.mark.parametrize("primitive", [0, 1])
def test_stored_normals_agree_with_the_geometry(reference: bytes, primitive: int) -> None:
    normals = attribute(reference, primitive, "NORMAL")
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-6)
    faces = triangles(reference, primitive)
    geometry = Mesh(attribute(reference, primitive, "POSITION"), faces)
    agreement = np.einsum("ij,ikj->ik", geometry.face_normals, normals[faces])
    assert agreement.min() > 0.5
    assert np.median(agreement) > 0.95


@pytest.mark.parametrize("primitive", [0, 1])
def test_texture_coordinates_cover_the_unit_square(reference: bytes, primitive: int) -> None:
    uv = attribute(reference, primitive, "TEXCOORD_0")
    assert uv.min() == 0
    assert uv.max() == 1


def test_every_triangle_has_a_colour(reference: bytes) -> None:
    assert face_colours().shape == surface(reference).faces.shape


def test_noise_has_the_stated_size(reference: bytes, source: bytes) -> None:
    before, after = surface(reference), surface(source)
    noise = (after.vertices - before.vertices) / Frame.of(before).radius
    assert noise.std() == pytest.approx(NOISE, rel=0.05)


def test_noise_opens_no_seam(source: bytes) -> None:
    assert inspect(surface(source), 100_000).watertight


@pytest.mark.parametrize("primitive", [0, 1])
def test_noise_leaves_texture_coordinates_alone(
    reference: bytes, source: bytes, primitive: int
) -> None:
    before = attribute(reference, primitive, "TEXCOORD_0")
    assert np.array_equal(attribute(source, primitive, "TEXCOORD_0"), before)


def test_noise_is_the_same_for_the_same_seed(reference: bytes, source: bytes) -> None:
    assert degraded(reference) == source
    assert degraded(reference, seed=1) != source
