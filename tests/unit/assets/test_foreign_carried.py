"""What vertices and faces of PLY and OFF files carry is told as that of a glTF is."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from meshcone.assets import Asset, read_asset
from meshcone.assets.content import Draw
from meshcone.srgb import to_linear
from tests.unit.assets.bisecting import bisected

PLACES = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
FACES = ((0, 1, 2), (0, 2, 3))


def ply(
    columns: str, rows: tuple[str, ...], faces: str = "", per_face: tuple[str, ...] = ()
) -> bytes:
    """A square whose vertices and faces have more than their places and corners."""
    head = "ply\nformat ascii 1.0\nelement vertex 4\n"
    names = "".join(f"property float {axis}\n" for axis in "xyz") + columns
    face = f"element face 2\nproperty list uchar int vertex_indices\n{faces}end_header\n"
    lines = [f"{x} {y} {z} {row}" for (x, y, z), row in zip(PLACES, rows, strict=True)]
    corners = [f"3 {a} {b} {c}" for a, b, c in FACES]
    told = [f"{c} {own}" for c, own in zip(corners, per_face or ("", ""), strict=True)]
    return (head + names + face + "\n".join([*lines, *told]) + "\n").encode()


def drawn(name: str, data: bytes) -> tuple[Asset, Draw]:
    asset = read_asset(name, data)
    [draw] = asset.content().draws
    return asset, draw


def test_a_ply_has_the_normals_coordinates_and_colours_of_its_vertices() -> None:
    columns = "".join(f"property float {name}\n" for name in ("nx", "ny", "nz", "s", "t"))
    columns += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue", "alpha"))
    asset, draw = drawn("a.ply", ply(columns, ("0 0 1 0 0.25 255 0 51 102",) * 4))

    assert draw.attributes["NORMAL"].at_corners()[0, 0].tolist() == [0, 0, 1]
    assert draw.attributes["TEXCOORD_0"].at_corners()[0, 0].tolist() == [0, 0.75]
    red, green, blue, alpha = draw.attributes["COLOR_0"].at_corners()[0, 0].tolist()
    assert (red, green, alpha) == (1, 0, pytest.approx(0.4))
    assert blue == pytest.approx(float(to_linear(np.array(0.2))))
    [primitive] = asset.content().meshes[0].primitives
    assert primitive.attributes == ("POSITION", "COLOR_0", "NORMAL", "TEXCOORD_0")
    assert primitive.gpu_bytes == {-1: 4 * 4 * (3 + 3 + 2 + 4) + 6 * 2}


def test_numbers_of_a_binary_ply_are_those_of_its_rows() -> None:
    text = ply("property uchar red\nproperty uchar green\nproperty uchar blue\n", ("0 0 0",) * 4)
    head = text[: text.index(b"end_header\n") + 11].replace(b"ascii", b"binary_big_endian")
    rows = b"".join(struct.pack(">3f3B", *place, 255, 0, 10 * n) for n, place in enumerate(PLACES))
    faces = b"".join(struct.pack(">B3i", 3, *face) for face in FACES)
    _, draw = drawn("a.ply", head + rows + faces)

    stored = draw.attributes["COLOR_0"].at_corners(as_stored=True)
    assert (255 * stored[1, :, 2]).tolist() == pytest.approx([0, 20, 30])


def test_numbers_of_no_known_kind_are_called_after_their_column() -> None:
    _, draw = drawn("a.ply", ply("property float quality\n", ("0", "1", "2", "3")))

    assert draw.others["_QUALITY"].at_corners()[:, :, 0].tolist() == [[0, 1, 2], [0, 2, 3]]


def test_faces_of_a_ply_have_numbers_and_coordinates_at_each_corner() -> None:
    lists = "property uchar red\nproperty list uchar float texcoord\n"
    told = ("9 6 0 0 1 0 1 1", "7 0")
    _, draw = drawn("a.ply", ply("", ("",) * 4, lists, told))

    assert draw.others["_FACE_RED"].at_corners()[:, 0, 0].tolist() == [9, 7]
    coordinates = draw.attributes["TEXCOORD_0"].at_corners()
    assert coordinates[0].tolist() == [[0, 1], [1, 1], [1, 0]]
    assert np.isnan(coordinates[1]).all()


def test_a_list_is_told_by_its_name() -> None:
    asset, _ = drawn("a.ply", ply("property list uchar int flags\n", ("1 2",) * 4))

    assert "_FLAGS" in asset.content().meshes[0].primitives[0].attributes


def test_a_row_that_is_cut_off_has_no_colour() -> None:
    columns = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    _, draw = drawn("a.ply", ply(columns, ("255 255 255", "", "255 255 255", "255 255 255")))

    known = np.isfinite(draw.attributes["COLOR_0"].at_corners()).all(axis=2)
    assert known.tolist() == [[True, False, True], [True, True, True]]


def off(keyword: str, row: str, face: str = "") -> bytes:
    rows = [f"{x} {y} {z} {row}" for x, y, z in PLACES]
    return "\n".join(
        [keyword, "4 2 0", *rows, *(f"3 {a} {b} {c} {face}" for a, b, c in FACES)]
    ).encode()


def test_the_keyword_of_an_off_says_what_its_vertices_carry() -> None:
    _, draw = drawn("a.off", off("STCNOFF", "0 0 1 255 0 0 255 0.5 1"))

    assert draw.attributes["NORMAL"].at_corners()[0, 0].tolist() == [0, 0, 1]
    assert draw.attributes["COLOR_0"].at_corners()[0, 0].tolist() == [1, 0, 0, 1]
    assert draw.attributes["TEXCOORD_0"].at_corners()[0, 0].tolist() == [0.5, 0]


def test_numbers_that_the_keyword_does_not_tell_are_called_after_their_place() -> None:
    _, draw = drawn("a.off", off("OFF", "7", face="255 0 0"))

    assert draw.others["_COLUMN_4"].at_corners()[0, 0].tolist() == [7]
    assert draw.others["_FACE_COLOR"].at_corners()[0, 0, :3].tolist() == [255, 0, 0]


def test_between_colours_of_zero_and_one_an_off_has_shares_of_one() -> None:
    rows = [f"{x} {y} {z} {x} 0 0 1" for x, y, z in PLACES]
    data = "\n".join(["COFF", "4 2 0", *rows, "3 0 1 2", "3 0 2 3"]).encode()
    asset = read_asset("a.off", data)

    again, draw = drawn("b.off", asset.divided(bisected(asset.faces, [0])))

    reds = draw.attributes["COLOR_0"].at_corners(as_stored=True)[..., 0]
    assert reds == pytest.approx(again.positions[again.triangles][..., 0])
    assert 0.5 in reds
