"""What the vertices of a glTF carry, where its triangles are divided."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meshcone.assets import read_asset
from meshcone.errors import InputError
from meshcone.surface import Subdivision
from tests.unit.assets.builders import Gltf, chunks
from tests.unit.assets.dividing import SQUARE, TWO, between, divided, square
from tests.unit.assets.plain_gltf import corners, table


def test_interleaved_attributes_are_stored_apart() -> None:
    gltf = Gltf()
    rows = np.concatenate([SQUARE, SQUARE[:, :2]], axis=1)
    view = gltf.view(rows.tobytes(), stride=20)
    named = {
        "POSITION": gltf.accessor(SQUARE, view),
        "TEXCOORD_0": gltf.accessor(SQUARE[:, :2], view, 12),
    }
    gltf.node(mesh=gltf.mesh({"attributes": named, "indices": gltf.accessor(TWO.reshape(-1))}))
    before = gltf.glb()
    after, subdivision = divided(before, [0, 1, 2])
    for name in named:
        expected = between(corners(before, name), subdivision)
        assert corners(after, name) == pytest.approx(expected)


def sparse(gltf: Gltf, accessor: int, rows: NDArray[Any], values: NDArray[Any]) -> None:
    """Have an accessor store some elements apart, in views that nothing else reads."""
    gltf.json["accessors"][accessor]["sparse"] = {
        "count": len(rows),
        "indices": {"bufferView": gltf.view(rows.tobytes()), "componentType": 5121},
        "values": {"bufferView": gltf.view(values.tobytes())},
    }


def views_read(document: dict[str, Any]) -> set[int]:
    parts = document["accessors"] + [
        each["sparse"][name]
        for each in document["accessors"]
        if "sparse" in each
        for name in ("indices", "values")
    ]
    return {part["bufferView"] for part in parts if "bufferView" in part}


@pytest.mark.parametrize(
    ("uv", "apart"),
    [
        (SQUARE[:, :2], np.array([[9, 9]], np.float32)),
        # Half a step would be seen: they become floats, and with them what is apart.
        (
            np.array([[0, 0], [65535, 1], [0, 0], [1, 65535]], np.uint16),
            np.array([[65534, 65535]], np.uint16),
        ),
    ],
    ids=["floats", "integers"],
)
def test_what_is_sparse_stays_so_and_leaves_no_view_unread(
    uv: NDArray[Any], apart: NDArray[Any]
) -> None:
    gltf = square(TEXCOORD_0=uv)
    sparse(gltf, 1, np.array([2], np.uint8), apart)
    before = gltf.glb()
    after, subdivision = divided(before, [0, 1])

    document = chunks(after)[0]
    assert document["accessors"][1]["sparse"]["count"] == 1
    assert views_read(document) == set(range(len(document["bufferViews"])))
    expected = between(corners(before, "TEXCOORD_0"), subdivision)
    assert corners(after, "TEXCOORD_0") == pytest.approx(expected, abs=1e-7)


def test_a_sparse_accessor_of_zeros_is_given_its_elements() -> None:
    gltf = square(TEXCOORD_0=SQUARE[:, :2])
    sparse(gltf, 1, np.array([1, 3], np.uint8), np.array([[1, 0], [0, 1]], np.float32))
    del gltf.json["accessors"][1]["bufferView"]
    gltf.json["bufferViews"][1]["name"] = "unread"
    before = gltf.glb()
    after, subdivision = divided(before, [0, 1])

    assert "sparse" in chunks(after)[0]["accessors"][1]
    expected = between(corners(before, "TEXCOORD_0"), subdivision)
    assert corners(after, "TEXCOORD_0") == pytest.approx(expected)


def test_elements_in_one_view_with_those_apart_are_stored_in_full() -> None:
    gltf = square(TEXCOORD_0=SQUARE[:, :2])
    values = np.array([[9, 9]], np.float32)
    view = gltf.view(SQUARE[:, :2].tobytes() + values.tobytes())
    sparse(gltf, 1, np.array([2], np.uint8), values)
    gltf.json["accessors"][1]["bufferView"] = view
    gltf.json["accessors"][1]["sparse"]["values"] = {"bufferView": view, "byteOffset": 32}
    before = gltf.glb()
    after, subdivision = divided(before, [0, 1])

    assert "sparse" not in chunks(after)[0]["accessors"][1]
    expected = between(corners(before, "TEXCOORD_0"), subdivision)
    assert corners(after, "TEXCOORD_0") == pytest.approx(expected)


def test_integers_become_floats_where_half_a_step_is_seen() -> None:
    uv = np.array([[0, 0], [65535, 1], [65534, 65535], [1, 65535]], dtype=np.uint16)
    before = square(TEXCOORD_0=uv).glb()
    after, subdivision = divided(before, [0, 1])
    expected = between(corners(before, "TEXCOORD_0"), subdivision)
    assert corners(after, "TEXCOORD_0") == pytest.approx(expected, abs=1e-7)
    accessor = chunks(after)[0]["accessors"][1]
    assert (accessor["componentType"], accessor.get("normalized", False)) == (5126, False)


def test_colours_keep_their_type_to_half_a_step() -> None:
    colors = np.array([[0, 0, 0, 255], [255, 3, 0, 255], [8, 8, 9, 255], [1, 1, 1, 0]], np.uint8)
    before = square(COLOR_0=colors).glb()
    after, subdivision = divided(before, [0, 1])
    assert table(after, 1).dtype == np.uint8
    expected = between(corners(before, "COLOR_0"), subdivision)
    assert np.abs(corners(after, "COLOR_0") - expected).max() <= 0.5 / 255 + 1e-9


def test_normals_are_of_unit_length_and_tangents_keep_their_sign() -> None:
    slanted = np.array([[1, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1]], dtype=np.float32)
    slanted /= np.linalg.norm(slanted, axis=1, keepdims=True)
    tangents = np.array([[1, 0, 0, -1], [0, 1, 0, -1], [1, 0, 0, -1], [0, 1, 0, -1]], np.float32)
    before = square(NORMAL=slanted, TANGENT=tangents).glb()
    after, subdivision = divided(before, [0, 1, 2])
    for name in ("NORMAL", "TANGENT"):
        expected = between(corners(before, name)[..., :3], subdivision)
        expected /= np.linalg.norm(expected, axis=2, keepdims=True)
        assert corners(after, name)[..., :3] == pytest.approx(expected, abs=1e-6)
    assert (corners(after, "TANGENT")[..., 3] == -1).all()


def test_normals_that_cancel_out_take_one_end_s() -> None:
    opposed = np.array([[0, 0, 1], [0, 0, -1], [0, 0, 1], [0, 0, -1]], dtype=np.float32)
    after, _ = divided(square(NORMAL=opposed).glb(), [0, 1, 2, 3])
    assert np.linalg.norm(table(after, 1), axis=1) == pytest.approx(1)


def test_morph_targets_are_divided_with_their_mesh() -> None:
    gltf = square()
    moves = np.array([[0, 0, 1], [0, 0, 2], [0, 3, 0], [4, 0, 0]], dtype=np.float32)
    target = {"POSITION": gltf.accessor(moves), "NORMAL": gltf.accessor(moves)}
    gltf.json["meshes"][0]["primitives"][0]["targets"] = [target]
    before = gltf.glb()
    after, subdivision = divided(before, [0, 1, 2])
    for name in target:
        expected = between(corners(before, name, target=0), subdivision)
        assert corners(after, name, target=0) == pytest.approx(expected)


def skinned(joints: list[list[int]], weights: NDArray[Any]) -> Gltf:
    gltf = square(JOINTS_0=np.array(joints, dtype=np.uint8), WEIGHTS_0=weights)
    bones = [gltf.node() for _ in range(9)]
    gltf.json["skins"] = [{"joints": bones}]
    gltf.json["nodes"][0]["skin"] = 0
    return gltf


def test_joints_are_merged_and_their_weights_added() -> None:
    joints = [[0, 1, 0, 0], [1, 2, 0, 0], [2, 0, 0, 0], [0, 0, 0, 0]]
    weights = np.array(
        [[0.5, 0.5, 0, 0], [0.25, 0.75, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0]], dtype=np.float32
    )
    before = skinned(joints, weights).glb()
    after, subdivision = divided(before, [0, 1, 2])

    def of_bones(glb: bytes) -> NDArray[np.float64]:
        bones = corners(glb, "JOINTS_0").astype(int)
        found = np.zeros((*bones.shape[:2], 9))
        for column in range(4):
            rows = np.indices(bones.shape[:2])
            np.add.at(found, (*rows, bones[..., column]), corners(glb, "WEIGHTS_0")[..., column])
        return found

    assert of_bones(after) == pytest.approx(between(of_bones(before), subdivision), abs=1e-6)
    assert read_asset("a.glb", before).division_notices(subdivision) == ()


def test_new_vertices_follow_ten_poses_where_weights_agree() -> None:
    """Halfway between two vertices that follow the same joints, in any pose."""
    joints = [[0, 1, 2, 3]] * 4
    weights = np.array([[0.4, 0.3, 0.2, 0.1]] * 4, dtype=np.float32)
    before = skinned(joints, weights).glb()
    after, subdivision = divided(before, [0, 1, 2, 3])
    random = np.random.default_rng(5)
    for _ in range(10):
        bones = np.linalg.qr(random.normal(size=(9, 3, 3)))[0], random.normal(size=(9, 3))
        expected = between(posed(before, *bones), subdivision)
        assert posed(after, *bones) == pytest.approx(expected, abs=1e-6)


def posed(
    glb: bytes, turns: NDArray[np.float64], moves: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(f, 3, 3) corners by linear blend skinning."""
    places = corners(glb, "POSITION")
    bones = corners(glb, "JOINTS_0").astype(int)
    each = np.einsum("fcjab,fcb->fcja", turns[bones], places) + moves[bones]
    return np.einsum("fcj,fcja->fca", corners(glb, "WEIGHTS_0"), each)


def test_diagonals_that_are_swapped_take_every_attribute_with_them() -> None:
    """Of two triangles with the sides 0-2 in common, those with 1-3 in common."""
    texture = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
    before = square(TEXCOORD_0=texture).glb()
    slots = np.array([[0, 1, 5], [1, 2, 5]])
    asset = read_asset("a.glb", before)
    swapped = Subdivision(2, np.arange(2), Subdivision.none(2).corners, 0, slots)
    after = asset.divided(swapped)
    assert read_asset("a.glb", after).triangles.tolist() == [[0, 1, 3], [1, 2, 3]]
    assert corners(after, "TEXCOORD_0") == pytest.approx(texture[[[0, 1, 3], [1, 2, 3]]])
    assert [each.code for each in asset.division_notices(swapped)] == ["writing.diagonals"]


def test_joints_without_room_are_left_out_and_said() -> None:
    joints = [[0, 1, 2, 3], [4, 5, 6, 7], [4, 5, 6, 7], [0, 1, 2, 3]]
    weights = np.array([[100, 80, 50, 25]] * 4, dtype=np.uint8)
    before = skinned(joints, weights).glb()
    after, subdivision = divided(before, [0])
    (notice,) = read_asset("a.glb", before).division_notices(subdivision)
    assert notice.code == "writing.weights"
    assert "29.4%" in notice.words  # 75 of 255
    stored = table(after, 2)[4:].astype(int)
    assert (stored.sum(axis=1) == 255).all()
    assert set(table(after, 1)[4].tolist()) == {0, 1, 4, 5}


def test_an_identifier_that_is_the_same_on_both_sides_is_kept() -> None:
    ids = np.array([[7], [7], [7], [7]], dtype=np.float32)
    after, _ = divided(square(_FEATURE_ID_0=ids).glb(), [0, 1])
    assert (table(after, 1) == 7).all()


def test_numbers_of_an_application_are_interpolated() -> None:
    heat = np.array([[0.0], [1], [2], [3]], dtype=np.float32)
    before = square(_HEAT=heat).glb()
    after, subdivision = divided(before, [0, 1])
    expected = between(corners(before, "_HEAT"), subdivision)
    assert corners(after, "_HEAT") == pytest.approx(expected)


def with_extension(name: str, value: dict[str, Any]) -> Gltf:
    gltf = square()
    gltf.json["meshes"][0]["primitives"][0]["extensions"] = {name: value}
    gltf.json["extensionsUsed"] = [name]
    return gltf


MIRRORED = np.array([[1, 0, 0, 1], [1, 0, 0, -1]] * 2, dtype=np.float32)


@pytest.mark.parametrize(
    ("gltf", "words"),
    [
        (square(_FEATURE_ID_0=np.array([[0.0], [1], [2], [3]], np.float32)), "_FEATURE_ID_0"),
        (square(_BATCHID=np.array([[0], [1], [2], [3]], np.uint16)), "_BATCHID"),
        (square(NORMAL=SQUARE * 0 + np.float32([0, 0, 1]), TANGENT=MIRRORED), "TANGENT"),
        (with_extension("EXT_structural_metadata", {"propertyAttributes": [0]}), "property"),
        (with_extension("EXT_mesh_features", {"featureIds": [{"featureCount": 4}]}), "feature"),
        (with_extension("CESIUM_primitive_outline", {"indices": 0}), "CESIUM_primitive_outline"),
    ],
    ids=["features", "batches", "tangents", "attributes", "implicit", "outline"],
)
def test_what_does_not_hold_between_vertices_is_refused(gltf: Gltf, words: str) -> None:
    with pytest.raises(InputError, match=words) as refused:
        divided(gltf.glb(), [0, 1, 2, 3])
    assert refused.value.file == "a.glb"
    assert refused.value.place is not None
