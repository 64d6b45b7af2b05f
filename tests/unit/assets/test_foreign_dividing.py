"""PLY, STL and OFF files with faces divided, as other readers read them."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from meshcone.assets import Asset, read_asset
from meshcone.errors import InputError
from meshcone.surface import Subdivision
from tests.unit.assets.bisecting import bisected
from tests.unit.assets.test_foreign_writing import FILES

PICKS = [3, 50, 7, 200, 1, 90]


def points_of(asset: Asset, subdivision: Subdivision) -> NDArray[np.float64]:
    """(f, 3, 3) corners of the divided faces, by the subdivision alone."""
    corners = asset.vertices[asset.faces[subdivision.parents]]
    return np.einsum("fcp,fpk->fck", subdivision.corners / 2.0**subdivision.exponent, corners)


def theirs(name: str, data: bytes) -> NDArray[np.float64]:
    mesh = trimesh.load_mesh(io.BytesIO(data), file_type=name[-3:], process=False)
    return np.asarray(mesh.triangles)


def in_order(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """(f, 9) corners in an order that does not depend on how a reader lists them."""
    rounded = np.round(triangles, 5) + 0.0
    turned = np.stack([np.roll(rounded, turn, axis=1).reshape(-1, 9) for turn in range(3)])
    first = np.lexsort(turned.transpose(2, 0, 1)[::-1], axis=0)[0]
    rows = turned[first, np.arange(len(rounded))]
    return rows[np.lexsort(rows.T[::-1])]


@pytest.mark.parametrize("name", FILES)
def test_the_faces_are_those_that_were_asked_for(name: str) -> None:
    asset = read_asset(name, FILES[name])
    subdivision = bisected(asset.faces, PICKS)
    data = asset.divided(subdivision)
    again = read_asset(name, data)
    expected = points_of(asset, subdivision)
    found = again.vertices[again.faces]
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() < 2e-6


@pytest.mark.parametrize(
    "name", [n for n in FILES if n not in ("big.ply", "mixed.ply", "normals.off")]
)
def test_another_reader_finds_them_too(name: str) -> None:
    asset = read_asset(name, FILES[name])
    subdivision = bisected(asset.faces, PICKS)
    found = in_order(theirs(name, asset.divided(subdivision)))
    assert np.abs(found - in_order(points_of(asset, subdivision))).max() < 2e-5


@pytest.mark.parametrize("name", FILES)
@settings(max_examples=10, deadline=None)
@given(picks=st.lists(st.integers(0, 10_000), max_size=8))
def test_no_crack_opens(name: str, picks: list[int]) -> None:
    asset = read_asset(name, FILES[name])
    subdivision = bisected(asset.faces, picks)
    again = read_asset(name, asset.divided(subdivision))
    over = subdivision.over(asset.faces, len(asset.vertices))
    assert len(again.vertices) == len(asset.vertices) + len(over.corners)
    assert open_sides(again.faces) == open_sides(over.faces)


def open_sides(faces: NDArray[np.int64]) -> int:
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    return int((np.unique(sides, axis=0, return_counts=True)[1] == 1).sum())


@pytest.mark.parametrize("name", ["binary.ply", "ascii.ply"])
def test_a_new_vertex_has_the_colour_between(name: str) -> None:
    asset = read_asset(name, FILES[name])
    (middle, *_), divided = halved(asset)
    one, other = (
        trimesh.load_mesh(io.BytesIO(data), file_type="ply", process=False)
        for data in (FILES[name], divided)
    )
    between = one.visual.vertex_colors[asset.faces[0, :2]].astype(float).mean(axis=0)
    assert np.abs(other.visual.vertex_colors[middle] - between).max() <= 0.5


def test_a_new_vertex_has_the_unit_normal_between() -> None:
    asset = read_asset("ascii.ply", FILES["ascii.ply"])
    (middle, *_), divided = halved(asset)
    columns = [
        FILES["ascii.ply"].split(b"property ").index(b"float n%c\n" % axis) - 1 for axis in b"xyz"
    ]

    def normal(data: bytes, row: int) -> NDArray[np.float64]:
        words = data.partition(b"end_header\n")[2].split(b"\n")[row].split()
        return np.array([float(words[column]) for column in columns])

    mean = sum(normal(FILES["ascii.ply"], int(row)) for row in asset.faces[0, :2])
    assert np.allclose(normal(divided, middle), mean / np.linalg.norm(mean), atol=1e-5)


def halved(asset: Asset) -> tuple[list[int], bytes]:
    """The numbers of new vertices, and the file with the first side of the first face split."""
    subdivision = bisected(asset.faces, [0])
    new = len(subdivision.over(asset.faces, len(asset.vertices)).corners)
    start = len(asset.positions)
    return list(range(start, start + new)), asset.divided(subdivision)


TWO = b"""ply\r
format ascii 1.0\r
element vertex 4\r
property float x\r
property float y\r
property float z\r
property int part\r
element face 2\r
property uchar red\r
property list uchar int vertex_indices\r
property list uchar float texcoord\r
element edge 1\r
property int vertex1\r
property int vertex2\r
end_header\r
0 0 0 7\r
1.50 0 0 7\r
1.5 1 0 7\r
0 1 0 %d\r
9 3 0 1 2 6 0 0 1 0 1 1\r
200 3 0 2 3 6 0 0 .5 1 0 1\r
0 3\r
"""
FIRST_SIDE = Subdivision(
    2,
    np.array([0, 0, 1]),
    np.array(
        [
            [[2, 0, 0], [1, 1, 0], [0, 0, 2]],
            [[1, 1, 0], [0, 2, 0], [0, 0, 2]],
            [[2, 0, 0], [0, 2, 0], [0, 0, 2]],
        ]
    ),
    1,
)


def test_what_is_not_divided_stays_byte_for_byte_and_faces_keep_their_properties() -> None:
    source = TWO % 7
    found = read_asset("two.ply", source).divided(FIRST_SIDE)
    lines = found.split(b"\r\n")
    before = source.split(b"\r\n")
    assert lines[2] == b"element vertex 5"
    assert lines[7] == b"element face 3"
    assert [each for each in before if each not in lines] == [before[2], before[7], before[19]]
    assert lines[19] == b"0.75 0 0 7"
    assert lines[20:22] == [
        b"9 3 0 4 2 6 0 0 0.5 0 1 1",
        b"9 3 4 1 2 6 0.5 0 1 0 1 1",
    ]


def test_a_number_that_is_no_shade_is_not_interpolated() -> None:
    split = replace(FIRST_SIDE, corners=FIRST_SIDE.corners[[2, 0, 1]], parents=np.array([0, 1, 1]))
    turned = np.roll(split.corners, 1, axis=2)  # the side from the third corner to the first
    turned[0] = split.corners[0]
    with pytest.raises(InputError, match="'part' differs along an edge to divide") as refused:
        read_asset("two.ply", TWO % 8).divided(replace(split, corners=turned))
    assert refused.value.place == "element vertex"


def test_a_list_of_a_face_that_may_be_of_its_corners_is_refused() -> None:
    source = (TWO % 7).replace(b"float texcoord", b"float weights")
    with pytest.raises(InputError, match="the list 'weights' of a face to divide"):
        read_asset("two.ply", source).divided(FIRST_SIDE)


def test_strips_of_triangles_are_not_divided() -> None:
    source = (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        b"property float z\nelement tristrips 1\nproperty list int int vertex_indices\n"
        b"end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    halves = Subdivision(1, FIRST_SIDE.parents[:2], FIRST_SIDE.corners[:2], 1)
    with pytest.raises(InputError, match="strip"):
        read_asset("strips.ply", source).divided(halves)


def test_an_index_that_does_not_fit_its_type_is_refused() -> None:
    def file(count: int) -> bytes:
        positions = np.zeros((count, 3), dtype="<f4")
        positions[1, 0] = positions[2, 1] = 1
        head = (
            f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\n"
            "property float y\nproperty float z\nelement face 1\n"
            "property list uchar uchar vertex_indices\nend_header\n"
        )
        return head.encode() + positions.tobytes() + bytes([3, 0, 1, 2])

    halves = Subdivision(1, FIRST_SIDE.parents[:2], FIRST_SIDE.corners[:2], 1)
    assert len(read_asset("a.ply", file(255)).divided(halves)) > len(file(255))
    with pytest.raises(InputError, match="stored as uint8, which does not hold"):
        read_asset("a.ply", file(256)).divided(halves)


def test_off_keeps_comments_colours_and_wrapped_lines() -> None:
    source = (
        b"COFF # a\n4 2 5\n0 0 0 255 0 0 255\n2 0 # b\n0 0 0 0 255\n2 2 0 0 0 0 255\n"
        b"0 2 0 0 0 0 255\n3 0 1\n2 9 9 9\n3 0 2 3 1 1 1 # c\n"
    )
    found = read_asset("a.off", source).divided(FIRST_SIDE)
    assert found == (
        b"COFF # a\n5 3 0\n0 0 0 255 0 0 255\n2 0 # b\n0 0 0 0 255\n2 2 0 0 0 0 255\n"
        b"0 2 0 0 0 0 255\n1 0 0 128 0 0 255\n3 0 4 2 9 9 9\n3 4 1 2 9 9 9\n3 0 2 3 1 1 1 # c\n"
    )


def test_an_stl_s_parts_have_the_normal_and_name_of_their_facet() -> None:
    source = (
        b"solid two parts\n  facet normal 0 0 1\n    outer loop\n      vertex 0 0 0\n"
        b"      vertex 1.0 0 0\n      vertex 0 1 0\n    endloop\n  endfacet\nendsolid two parts\n"
    )
    halves = Subdivision(1, FIRST_SIDE.parents[:2], FIRST_SIDE.corners[:2], 1)
    found = read_asset("a.stl", source).divided(halves)
    assert found.count(b"  facet normal 0 0 1\n    outer loop\n      vertex ") == 2
    assert b"      vertex 0.5 0 0\n      vertex 1.0 0 0\n      vertex 0 1 0\n" in found
    assert found.startswith(b"solid two parts\n  facet")
    assert found.endswith(b"\n  endfacet\nendsolid two parts\n")


def plain_ply(vertices: bytes, *, of_vertices: bytes = b"", of_faces: bytes = b"") -> bytes:
    """A triangle, whose header has Windows line ends and whose rows have others."""
    head = (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        b"property float z\n" + of_vertices + b"element face 1\n"
        b"property list uchar int vertex_indices\n" + of_faces + b"end_header\n"
    )
    return head.replace(b"\n", b"\r\n") + vertices + b"3 0 1 2\n"


HALVES = Subdivision(1, FIRST_SIDE.parents[:2], FIRST_SIDE.corners[:2], 1)


def test_rows_may_end_in_another_way_than_the_header() -> None:
    source = plain_ply(b"0 0 0\n2 0 0\n0 2 0\n")
    found = read_asset("a.ply", source).divided(HALVES)
    assert found.endswith(b"\r\n0 0 0\n2 0 0\n0 2 0\n1 0 0\n3 0 3 2\n3 3 1 2\n")


def test_an_off_may_end_its_lines_in_several_ways() -> None:
    source = b"OFF\r\n3 1 0\r\n0 0 0\r\n2 0 0\n0 2 0\n3 0 1 2\r\n"
    found = read_asset("a.off", source).divided(HALVES)
    assert found.endswith(b"0 2 0\n1 0 0\n3 0 3 2\n3 3 1 2\r\n")


@pytest.mark.parametrize(
    ("element", "missing", "line"),
    [("of_vertices", "nx", "line 13"), ("of_faces", "part", "line 14")],
)
def test_rows_without_what_the_header_declares_are_refused_before_anything_is_solved(
    element: str, missing: str, line: str
) -> None:
    declared = {
        "of_vertices": b"property float nx\nproperty float ny\nproperty float nz\n",
        "of_faces": b"property uchar part\n",
    }[element]
    rows = b"0 0 0\n2 0 0\n0 2 0\n"
    source = plain_ply(rows, **{element: declared})
    with pytest.raises(InputError, match=f"expected 1 values of '{missing}', found 0") as refused:
        read_asset("a.ply", source).ensure_divisible()
    assert (refused.value.file, refused.value.place) == ("a.ply", line)
