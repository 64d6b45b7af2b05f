"""glTF files whose triangles are divided, read back by a reader of the tests' own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from meshcone.assets import read_asset
from meshcone.errors import InputError
from meshcone.surface import Mesh, Subdivision
from tests.unit.assets.bisecting import bisected
from tests.unit.assets.builders import Gltf, chunks, compress, cube_gltf, flat_gltf
from tests.unit.assets.plain_gltf import corners, table, triangles

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


def is_closed(glb: bytes) -> bool:
    asset = read_asset("a.glb", glb)
    return not Mesh(asset.vertices, asset.faces).border_sides.any()


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, 200), min_size=1, max_size=12))
def test_every_corner_has_what_lies_there(picks: list[int]) -> None:
    before = cube_gltf().glb()
    after, subdivision = divided(before, picks)
    for name in ("POSITION", "TEXCOORD_0"):
        expected = between(corners(before, name), subdivision)
        assert corners(after, name) == pytest.approx(expected, abs=2e-7)
    normals = corners(after, "NORMAL")
    assert np.linalg.norm(normals, axis=2) == pytest.approx(1, abs=1e-6)
    assert is_closed(after)


def test_vertices_that_were_there_keep_their_numbers_and_bytes() -> None:
    before = cube_gltf().glb()
    after, _ = divided(before, [0, 5, 9])
    for index in range(3):
        count = len(table(before, index))
        assert np.array_equal(table(after, index)[:count], table(before, index))
        assert len(table(after, index)) > count


def test_a_seam_has_a_new_vertex_on_either_side() -> None:
    """The diagonal of the square is stored once for each triangle, with texture coordinates."""
    apart = flat_gltf(SQUARE[TWO.reshape(-1)], np.arange(6))
    uv = np.arange(12, dtype=np.float32).reshape(6, 2)
    drawn = apart.json["meshes"][0]["primitives"][0]
    drawn["attributes"]["TEXCOORD_0"] = apart.accessor(uv)
    after, _ = divided(apart.glb(), [2])
    asset = read_asset("a.glb", after)
    assert (len(asset.vertices), len(asset.positions)) == (5, 8)
    assert table(after, drawn["attributes"]["POSITION"])[6:].tolist() == [[0.5, 0.5, 0]] * 2
    ends = {(0, 2), (3, 4)}
    found = {tuple(row) for row in table(after, drawn["attributes"]["TEXCOORD_0"])[6:].tolist()}
    assert found == {tuple(((uv[a] + uv[b]) / 2).tolist()) for a, b in ends}


def test_declared_bounds_hold_all_that_is_there() -> None:
    after, _ = divided(cube_gltf().glb(), [0, 1, 2])
    for index, accessor in enumerate(chunks(after)[0]["accessors"]):
        stored = table(after, index)
        assert accessor["min"] == stored.min(axis=0).tolist()
        assert accessor["max"] == stored.max(axis=0).tolist()


def test_nothing_is_left_in_the_file_that_nobody_reads() -> None:
    before, _ = chunks(cube_gltf().glb())
    after, _ = chunks(divided(cube_gltf().glb(), [0, 3])[0])
    for kind in ("accessors", "bufferViews", "meshes", "nodes", "buffers"):
        assert len(after[kind]) == len(before[kind])


def test_a_primitive_that_is_not_divided_stays_as_it_is() -> None:
    gltf = cube_gltf()
    other = {"attributes": {"POSITION": gltf.accessor(SQUARE + np.float32(5))}}
    other["indices"] = gltf.accessor(TWO.reshape(-1))
    gltf.node(mesh=gltf.mesh(other))
    before = gltf.glb()
    after, subdivision = divided(before, [0])
    assert not subdivision.divided[12:].any()
    was, now = chunks(before)[0], chunks(after)[0]
    assert now["meshes"][1] == was["meshes"][1]
    assert now["accessors"][4:6] == was["accessors"][4:6]
    assert np.array_equal(table(after, 4), table(before, 4))


def two_halves(*, shared: bool) -> bytes:
    """A square of two primitives, over the same vertices or each over its own."""
    gltf = Gltf()
    position = gltf.accessor(SQUARE)
    for half in TWO:
        own = position if shared else gltf.accessor(SQUARE)
        primitive = {"attributes": {"POSITION": own}, "indices": gltf.accessor(half)}
        if not gltf.json["meshes"]:
            gltf.node(mesh=gltf.mesh(primitive))
        else:
            gltf.json["meshes"][0]["primitives"].append(primitive)
    return gltf.glb()


@pytest.mark.parametrize("shared", [True, False])
def test_primitives_that_meet_are_divided_at_the_same_points(shared: bool) -> None:
    after, subdivision = divided(two_halves(shared=shared), [2, 0, 4, 1])
    asset = read_asset("a.glb", after)
    border = Mesh(asset.vertices, asset.faces).border_sides.sum()
    ends = subdivision.over(np.array([[0, 1, 2], [0, 2, 3]]), 4)
    assert border == Mesh(np.zeros((4 + len(ends.corners), 3)), ends.faces).border_sides.sum()
    drawn = chunks(after)[0]["meshes"][0]["primitives"]
    assert (drawn[0]["attributes"] == drawn[1]["attributes"]) is shared


def test_what_others_read_stays_for_them() -> None:
    gltf = square()
    gltf.json["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 0})
    before = gltf.glb()
    after, _ = divided(before, [0])
    drawn = chunks(after)[0]["meshes"][0]["primitives"]
    assert drawn[1]["attributes"]["POSITION"] == 0
    assert np.array_equal(table(after, 0), SQUARE)
    assert len(table(after, drawn[0]["attributes"]["POSITION"])) == 5


@pytest.mark.parametrize(("vertices", "narrow", "wide"), [(254, "u1", "u2"), (65534, "u2", "u4")])
def test_indices_are_widened_where_their_type_has_no_more(
    vertices: int, narrow: str, wide: str
) -> None:
    positions = np.zeros((vertices, 3), dtype=np.float32)
    positions[:4], positions[4:, 0] = SQUARE, 1
    gltf = flat_gltf(positions)
    drawn = gltf.json["meshes"][0]["primitives"][0]
    drawn["indices"] = gltf.accessor(TWO.reshape(-1).astype(narrow))
    for picks, dtype in (([0], narrow), ([0, 0], wide)):
        after, _ = divided(gltf.glb(), picks)
        assert table(after, drawn["indices"]).dtype == np.dtype(dtype)
        assert triangles(after).max() == vertices + len(picks) - 1


@pytest.mark.parametrize(("mode", "order"), [(5, [1, 2, 0, 3]), (6, [0, 1, 2, 3])])
@pytest.mark.parametrize("indexed", [True, False])
def test_strips_and_fans_become_triangles(mode: int, order: list[int], indexed: bool) -> None:
    vertices = SQUARE if indexed else SQUARE[order]
    gltf = flat_gltf(vertices, np.array(order) if indexed else None, mode=mode)
    before = gltf.glb()
    after, subdivision = divided(before, [0, 1])
    assert chunks(after)[0]["meshes"][0]["primitives"][0]["mode"] == 4
    was = corners(before, "POSITION")
    now = corners(after, "POSITION")
    assert _areas(now).sum() == pytest.approx(1)
    assert _areas(now) == pytest.approx(_areas(between(_like_read(was, mode), subdivision)))


def _areas(places: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])[:, 2] / 2


def _like_read(places: NDArray[np.float64], mode: int) -> NDArray[np.float64]:
    """Corners of a fan in the order in which the specification lists them."""
    return places[:, [1, 2, 0]] if mode == 6 else places


def test_triangles_without_indices_get_some() -> None:
    before = flat_gltf(SQUARE[TWO.reshape(-1)]).glb()
    after, subdivision = divided(before, [0])
    expected = between(corners(before, "POSITION"), subdivision)
    assert corners(after, "POSITION") == pytest.approx(expected)
    read_asset("a.glb", after)


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


def test_a_mirrored_node_keeps_its_triangles_outward() -> None:
    before = cube_gltf(scale=[-1, 1, 1]).glb()
    after, subdivision = divided(before, [0, 4, 7])
    asset = read_asset("a.glb", after)
    mesh = Mesh(asset.vertices, asset.faces)
    outward = mesh.corners.mean(axis=1) - mesh.vertices.mean(axis=0)
    assert (np.einsum("ij,ij->i", mesh.face_normals, outward) > 0).all()
    assert len(asset.faces) == len(subdivision.parents)
    source = read_asset("a.glb", before)
    expected = between(source.vertices[source.faces], subdivision)
    assert mesh.corners == pytest.approx(expected, abs=1e-6)


def test_a_mesh_drawn_twice_is_divided_once_where_both_agree() -> None:
    gltf = cube_gltf()
    gltf.node(mesh=0, translation=[5, 0, 0])
    asset = read_asset("a.glb", gltf.glb())
    one = bisected(asset.faces[:12], [0, 5])
    parents = np.concatenate([one.parents, one.parents + 12])
    both = Subdivision(24, parents, np.concatenate([one.corners] * 2), one.exponent)
    after = asset.divided(both)
    assert len(chunks(after)[0]["meshes"]) == 1
    assert len(read_asset("a.glb", after).faces) == len(both.parents)
    with pytest.raises(InputError, match="in different ways"):
        asset.divided(bisected(asset.faces, [0]))


@pytest.mark.parametrize("scale", [[1, 1, 1], [1, -1, 1]])
def test_every_place_of_a_mesh_is_divided_as_the_first(scale: list[int]) -> None:
    gltf = cube_gltf()
    gltf.node(mesh=0, translation=[5, 0, 0], scale=scale)
    asset = read_asset("a.glb", gltf.glb())
    assert asset.twins().tolist() == [*range(12), *range(12)]
    alike = asset.divided_alike(bisected(asset.faces, [0, 5, 13]))
    assert alike.is_tiling()
    after = read_asset("b.glb", asset.divided(alike))
    places = after.vertices[after.faces]
    half = len(places) // 2
    first = places[:half] * scale + [5, 0, 0]
    if min(scale) < 0:
        first = first[:, ::-1]
    assert places[half:] == pytest.approx(first)


def test_draco_is_written_as_plain_buffers_and_said() -> None:
    before = compress(cube_gltf()).glb()
    after, subdivision = divided(before, [0, 1])
    document = chunks(after)[0]
    assert "extensions" not in document["meshes"][0]["primitives"][0]
    assert is_closed(after)
    (notice,) = read_asset("a.glb", before).division_notices(subdivision)
    assert notice.code == "writing.draco"


def test_the_result_is_the_same_each_time() -> None:
    assert divided(cube_gltf().glb(), [0, 3])[0] == divided(cube_gltf().glb(), [0, 3])[0]
