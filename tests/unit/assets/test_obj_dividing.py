"""OBJ files whose faces are divided, read by a reader that shares no code with the project's."""

from __future__ import annotations

import difflib
import io

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from meshcone.assets import Asset, WritePolicy, read_asset
from meshcone.errors import InputError
from tests.shapes import sphere
from tests.unit.assets.bisecting import EXPONENT, bisected
from tests.unit.assets.plain_obj import Corner, PlainObj, Polygon, read_plainly
from tests.unit.assets.random_obj import obj_files

PICKS = st.lists(st.integers(0, 10_000), min_size=1, max_size=8)

# A square with a seam in its texture and a hard edge along its diagonal, whose left border is a
# fold of two vertices at one place.
SEAMED = b"""v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt .25 .5
vt .75 1
vt 0 1
vn 0 0 1
vn 0 1 0
vn 0 0 -1
v 1 1 0
usemtl steel
s 1
f 1/1/1 2/2/1 3/3/2
s off
f 1/4/1 5/5/3 4/6/1
"""


def read(data: bytes) -> Asset:
    try:
        return read_asset("mesh.obj", data)
    except InputError as error:
        assume("have no area" not in error.message)
        raise


def corner_values(asset: Asset) -> np.ndarray:
    """(k, 3, 8) place, texture coordinate and normal at each corner, NaN where there is none."""
    values = np.full((len(asset.triangles), 3, 8), np.nan)
    values[:, :, :3] = asset.positions[asset.triangles]
    for draw in asset.content().draws:
        for name, columns in (("TEXCOORD_0", slice(3, 5)), ("NORMAL", slice(5, 8))):
            if name in draw.attributes:
                values[draw.rows, :, columns] = draw.attributes[name].at_corners()
    values[:, :, 4] = 1 - values[:, :, 4]  # it counts downwards there
    return values


def plain_values(corners: list[Corner]) -> np.ndarray:
    """The same of a face that was read plainly."""
    values = np.full((3, 8), np.nan)
    for row, (place, texture, normal) in enumerate(corners):
        assert place is not None
        values[row, :3] = place[:3]
        if texture is not None:
            values[row, 3:5] = (*texture, 0.0)[:2]
        if normal is not None:
            values[row, 5:] = normal[:3]
    return values


def interpolated(corners: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """What lies between a parent's corners (3, 8), at the corners (3, 3) of a child."""
    return np.array(
        [
            np.sum([c * (w / 2**EXPONENT) for w, c in zip(row, corners, strict=True) if w], axis=0)
            for row in weights
        ]
    )


def faces(found: PlainObj) -> list[Polygon]:
    return [each for each in found.drawn if each.keyword == b"f" and len(each.corners) >= 3]


@settings(deadline=None, max_examples=25)
@given(obj_files(), PICKS)
def test_every_new_corner_has_what_lies_between_those_of_its_parent(
    data: bytes, picks: list[int]
) -> None:
    asset = read(data)
    subdivision = bisected(asset.faces, picks)
    values = corner_values(asset)
    drawn = [
        plain_values(each.corners)
        for each in faces(read_plainly(asset.divided(subdivision)))
        if len(each.corners) == 3
    ]
    for parent, weights in zip(subdivision.parents, subdivision.corners, strict=True):
        if subdivision.divided[parent]:
            wanted = interpolated(values[asset.kept[parent]], weights)
            assert any(_agree(found, wanted) for found in drawn)


def _agree(found: np.ndarray, wanted: np.ndarray) -> bool:
    """Places to six digits, texture coordinates to 2e-7, directions of normals to four decimals.

    Where the normals of the parent cancel out, any is right.
    """
    size = max(np.abs(wanted[:, :3]).max(), 1)
    near = np.abs(found[:, :3] - wanted[:, :3]).max() <= 1e-5 * size
    same = np.allclose(found[:, 3:5], wanted[:, 3:5], rtol=0, atol=2e-7, equal_nan=True)
    ends = [rows[:, 5:] for rows in (found, wanted)]
    lengths = [np.linalg.norm(rows, axis=1) for rows in ends]
    along = (ends[0] * ends[1]).sum(axis=1) >= (1 - 1e-7) * lengths[0] * lengths[1]
    free = np.isnan(lengths[0]) & np.isnan(lengths[1]) | (lengths[1] < 1e-3)
    return bool(near and same and (along | free).all())


@settings(deadline=None, max_examples=25)
@given(obj_files(), PICKS)
def test_what_is_not_divided_says_what_it_said(data: bytes, picks: list[int]) -> None:
    asset = read(data)
    subdivision = bisected(asset.faces, picks)
    before, after = read_plainly(data), read_plainly(asset.divided(subdivision))
    assert after.others == before.others
    for keyword, table in before.tables.items():
        left = iter(after.tables[keyword])
        assert all(values in left for values in table)  # in the order in which they were
    lines = [[each for each in found.drawn if each.keyword != b"f"] for found in (before, after)]
    assert lines[0] == lines[1]
    polygons = np.repeat(np.arange(len(faces(before))), [len(e.corners) - 2 for e in faces(before)])
    divided = set(polygons[asset.kept[subdivision.divided]].tolist())
    left = iter(faces(after))
    assert all(face in left for number, face in enumerate(faces(before)) if number not in divided)


@settings(deadline=None, max_examples=25)
@given(obj_files(), PICKS)
def test_the_divided_file_is_read_as_the_faces_that_were_asked_for(
    data: bytes, picks: list[int]
) -> None:
    asset = read(data)
    subdivision = bisected(asset.faces, picks)
    again = read_asset("mesh.obj", asset.divided(subdivision))
    over = subdivision.over(asset.faces, len(asset.vertices))
    points = np.concatenate([asset.vertices, over.interpolated(asset.vertices)])
    # A new vertex that lies on another one is joined with it, and the face between is none.
    assume(len(np.unique(points, axis=0)) == len(points))
    assert len(again.faces) == len(over.faces)
    apart = again.vertices[again.faces] - points[over.faces]
    assert np.abs(apart).max() <= 1e-5 * max(1, np.abs(points).max())


def divided(data: bytes, *picks: int) -> bytes:
    asset = read(data)
    return asset.divided(bisected(asset.faces, picks))


def changes(before: bytes, after: bytes) -> list[str]:
    """The lines that differ, those that are new with +, those that are gone with -."""
    lines = (before.decode().splitlines(), after.decode().splitlines())
    found = difflib.unified_diff(*lines, n=0, lineterm="")
    return [line for line in found if line[0] in "+-" and line[:3] not in ("+++", "---")]


def test_both_sides_of_a_seam_are_split_where_they_are_stated():
    # The side from the third corner to the first, where the vertices of a place are two.
    assert changes(SEAMED, divided(SEAMED, 2)) == [
        "+vt 0.5 0.5",
        "+vt 0.5 0.75",
        "+vn 0 0.707107 0.707107",
        "+vn 0 0 1",  # the normals of its ends cancel out
        "+v 0.5 0.5 0",
        "+v 0.5 0.5 0",
        "-f 1/1/1 2/2/1 3/3/2",
        "+f 3/3/2 6/7/4 2/2/1",
        "+f 6/7/4 1/1/1 2/2/1",
        "-f 1/4/1 5/5/3 4/6/1",
        "+f 1/4/1 7/8/5 4/6/1",
        "+f 7/8/5 5/5/3 4/6/1",
    ]


def test_a_polygon_becomes_the_triangles_the_reader_made_of_it():
    square = b"v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 3 1 0\nf 1 2 3 4\nf 3 2 5\nf 1 4 3 2\n"
    assert changes(square, divided(square, 4)) == [
        "-f 1 2 3 4",
        "-f 3 2 5",
        "-f 1 4 3 2",
        "+v 2 1 0",
        "+f 2 6 1",
        "+f 6 3 1",
        "+f 1 3 4",
        "+f 3 6 5",
        "+f 6 2 5",
        "+f 1 4 3",
        "+f 3 6 1",
        "+f 6 2 1",
    ]


def test_vertices_after_faces_get_other_numbers_wherever_they_are_named():
    parts = (
        b"v 0 0 0\nv 2 0 0\nv 0 2 0\nf -3 -2 -1\n"
        b"v 5 0 0\nv 7 0 0\nv 5 2 0\nf 4 5 6\nf -3 -2 1\nl 1 4 -1\n"
    )
    assert changes(parts, divided(parts, 0)) == [
        "-f -3 -2 -1",
        "+v 1 0 0",
        "+f 1 4 3",
        "+f 4 2 3",
        "-f 4 5 6",
        "+f 5 6 7",
        "-l 1 4 -1",
        "+l 1 5 -1",
    ]


def test_numbers_that_count_back_over_new_vertices_count_farther():
    late = b"v 0 0 0\nv 2 0 0\nv 0 2 0\nv 5 0 0\nf 1 2 3\nf -1 -2 -3\nf 4 2 3\n"
    written = divided(late, 0)
    assert changes(late, written) == [
        "-f 1 2 3",
        "-f -1 -2 -3",
        "+v 1 0 0",
        "+f 1 5 3",
        "+f 5 2 3",
        "+f -2 -3 -4",
    ]


def test_a_number_that_named_nothing_names_nothing_new():
    unknown = b"v 0 0 0\nv 2 0 0\nv 0 2 0\nv 2 2 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
    unknown += b"f 1/1 2/2 3/3\nf 2/4 4/-9 3/3\n"
    assert "+f 2/5 4/-10 3/3" in changes(unknown, divided(unknown, 0))


def test_colours_after_a_position_are_interpolated():
    coloured = b"v 0 0 0 1 0 0\nv 2 0 0 0 .5 0\nv 0 2 0 0 0 1\nf 1 2 3\n"
    assert "+v 1 0 0 0.5 0.25 0" in changes(coloured, divided(coloured, 0))


def test_line_ends_comments_and_a_last_line_without_end_are_kept():
    spaced = b"v 0 0 0\r\nv 2 0 0 # b\r\nv 0 2 0\r\n  f 1 2 \\\r\n 3 # here\r\nf 1 3 2"
    assert divided(spaced, 2) == (
        b"v 0 0 0\r\nv 2 0 0 # b\r\nv 0 2 0\r\nv 0 1 0\r\n"
        b"f 3 4 2 # here\r\nf 4 1 2\r\nf 1 4 2\r\nf 4 3 2"
    )


def test_points_that_the_file_s_digits_would_join_get_more_of_them():
    tiny = b"v 0.000001 0 0\nv 0.000002 0 0\nv 500000 0 9\nv 0 0 5\nf 1 2 3\nf 1 3 4\n"
    asset = read_asset("mesh.obj", tiny)
    again = read_asset("mesh.obj", asset.divided(bisected(asset.faces, [0, 0, 0, 0])))
    assert len(again.faces) == len(asset.faces) + 4


def test_the_borders_of_a_mesh_with_seams_stay_closed():
    vertices, triangles = sphere(2)
    asset = read_asset("mesh.obj", unwelded(vertices, triangles))
    written = asset.divided(bisected(asset.faces, range(0, 400, 7)))
    mesh = trimesh.load_mesh(io.BytesIO(written), file_type="obj", process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    assert mesh.is_watertight
    assert len(mesh.faces) > len(triangles) + 50
    assert mesh.area == pytest.approx(trimesh.Trimesh(vertices, triangles).area, rel=1e-6)


def unwelded(vertices: np.ndarray, triangles: np.ndarray) -> bytes:
    """Every corner has a vertex and a texture coordinate of its own."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices[triangles].reshape(-1, 3)]
    lines += [f"vt {number / 7 % 1:.4f} {number / 11 % 1:.4f}" for number in range(len(lines))]
    corners = np.arange(3 * len(triangles)).reshape(-1, 3) + 1
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in corners]
    return "\n".join(lines).encode()


def test_a_divided_file_is_moved_as_any_other():
    asset = read_asset("mesh.obj", divided(SEAMED, 2, 0, 3))
    step = np.array([0, 0, 0.25])
    written = asset.patched(asset.vertices + step, WritePolicy(normals="keep"))
    assert np.allclose(read_asset("mesh.obj", written).positions, asset.positions + step)
