"""glTF files whose triangles are divided, read back by a reader of the tests' own."""

from __future__ import annotations

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
from tests.unit.assets.dividing import SQUARE, TWO, between, divided, square
from tests.unit.assets.plain_gltf import corners, table, triangles


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
