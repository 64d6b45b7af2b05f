"""PLY, STL and OFF are read as others write and read them."""

from __future__ import annotations

import io
import struct

import numpy as np
import pytest
import trimesh

from meshcone.assets import Limits, read_asset
from meshcone.errors import LimitError
from meshcone.notices import Code, Notice
from tests import meshes
from tests.fuzz import seeds
from tests.hostile.foreign import ragged

BALL = meshes.sphere(2)
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float32)
HEADER = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
)
ROWS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


def exported(kind: str, **options: object) -> bytes:
    mesh = trimesh.Trimesh(BALL.vertices, BALL.faces, process=False)
    data = mesh.export(file_type=kind, **options)
    return data.encode() if isinstance(data, str) else data


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("ball.ply", exported("ply")),
        ("ball.ply", exported("ply", encoding="ascii")),
        ("ball.ply", exported("ply", vertex_normal=True)),
        ("ball.off", exported("off", digits=17)),
        ("ball.stl", exported("stl")),
        ("ball.stl", exported("stl_ascii")),
    ],
    ids=["binary PLY", "ASCII PLY", "PLY with normals", "OFF", "binary STL", "ASCII STL"],
)
def test_what_trimesh_writes_is_read_as_trimesh_reads_it(name: str, data: bytes) -> None:
    asset = read_asset(name, data)
    theirs = trimesh.load_mesh(io.BytesIO(data), file_type=name[-3:], process=False)
    # trimesh rounds the text of an ASCII PLY to the type its header names.
    assert asset.vertices[asset.faces] == pytest.approx(theirs.vertices[theirs.faces], abs=1e-7)
    assert asset.counts().welded_vertices == len(BALL.vertices)


@pytest.mark.parametrize("data", [*seeds.PLY[:3], *seeds.STL, *seeds.OFF])
def test_every_encoding_of_a_mesh_is_the_same_mesh(data: bytes) -> None:
    asset = read_asset("mesh", data)
    corners = seeds.TETRAHEDRON[np.array(seeds.TRIANGLES)]
    assert np.array_equal(asset.vertices[asset.faces], corners)


def test_faces_of_a_binary_ply_may_differ_in_size() -> None:
    asset = read_asset("mesh.ply", seeds.mixed_ply())
    assert (asset.counts().polygons, asset.counts().faces) == (3, 4)
    corners = seeds.TETRAHEDRON[[[0, 1, 2], [1, 2, 3]]]
    assert np.array_equal(asset.vertices[asset.faces[2:]], corners)


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_a_ply_may_end_its_lines_in_any_way(line_end: str) -> None:
    text = (HEADER + ROWS + "4 0 1 2 3\n").replace("\n", line_end)
    assert read_asset("mesh.ply", text.encode()).counts().faces == 2


def test_binary_data_that_start_with_a_line_feed_are_no_line_end() -> None:
    header = HEADER.replace("ascii", "binary_little_endian").replace("\n", "\r").encode()
    points = SQUARE.copy()
    points[0, 0] = struct.unpack("<f", b"\n\0\0\0")[0]
    asset = read_asset("mesh.ply", header + points.tobytes() + struct.pack("<B4i", 4, 0, 1, 2, 3))
    assert np.array_equal(asset.vertices, points)


def test_a_remark_that_is_not_called_a_comment_is_one() -> None:
    header = HEADER.replace("element vertex", "Created by somebody, from: \nelement vertex")

    asset = read_asset("square.ply", (header + ROWS + "4 0 1 2 3\n").encode())

    assert asset.positions.tolist() == SQUARE.tolist()


@pytest.mark.parametrize("order", ["<", ">"])
def test_gaps_in_the_rows_of_a_ply_may_all_have_one_name(order: str) -> None:
    gap = "property uchar gap\n"
    kind = "binary_little_endian" if order == "<" else "binary_big_endian"
    header = HEADER.replace("ascii", kind).replace("property float y", f"{gap}property float y")
    header = header.replace("element face", f"{gap}element face")
    rows = b"".join(struct.pack(f"{order}fBffB", x, 7, y, z, 9) for x, y, z in SQUARE)
    data = header.encode() + rows + struct.pack(f"{order}B4i", 4, 0, 1, 2, 3)

    asset = read_asset("square.ply", data)
    moved = read_asset("square.ply", asset.patched(asset.vertices * 2))

    assert asset.positions.tolist() == SQUARE.tolist()
    assert moved.positions.tolist() == (2 * SQUARE).tolist()
    assert asset.patched(asset.vertices * 2).startswith(header.encode())


def test_lists_beside_the_corners_are_passed_over() -> None:
    header = HEADER.replace(
        "property list", "property list uchar float uv\nproperty uchar a\nproperty list"
    )
    asset = read_asset("mesh.ply", (header + ROWS + "2 .5 .5 7 3 0 1 2\n").encode())
    assert asset.faces.tolist() == [[0, 1, 2]]


def test_a_concave_polygon_is_cut_within_its_outline() -> None:
    rows = "0 0 0\n4 0 0\n1 1 0\n0 4 0\n"
    asset = read_asset("mesh.off", f"OFF\n4 1 0\n{rows}4 0 1 2 3\n".encode())
    a, b, c = (asset.vertices[asset.faces[:, corner]] for corner in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_a_face_of_two_corners_is_ignored_with_a_warning() -> None:
    text = HEADER.replace("face 1", "face 2") + ROWS + "2 0 1\n3 0 1 2\n"
    asset = read_asset("mesh.ply", text.encode())
    assert asset.warnings == (
        Notice(Code.FACES_TOO_FEW_CORNERS, "1 faces with fewer than 3 corners; ignored"),
    )


def test_the_words_of_an_ascii_stl_may_be_in_capitals() -> None:
    assert read_asset("mesh.stl", seeds.ascii_stl().upper()).counts().faces == 4


def test_counts_may_follow_the_keyword_of_an_off() -> None:
    assert read_asset("mesh.off", seeds.off("OFF")).counts().faces == 4


def test_strips_of_a_ply_are_triangles_that_all_turn_the_same_way() -> None:
    """Two strips in one list; the first repeats a corner to turn, which is no triangle."""
    header = HEADER.replace("element vertex 4", "element vertex 6").replace("face", "tristrips")
    rows = "0 0 0\n0 1 0\n1 0 0\n1 1 0\n2 0 0\n2 1 0\n"
    strips = "10 0 2 1 3 3 5 -1 2 4 3\n"
    asset = read_asset("mesh.ply", (header + rows + strips).encode())
    assert asset.faces.tolist() == [[0, 2, 1], [1, 2, 3], [2, 4, 3]]
    assert asset.counts().faces == 3
    a, b, c = (asset.vertices[asset.faces[:, corner]] for corner in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_strips_of_a_binary_ply_are_read_too() -> None:
    header = HEADER.replace("ascii", "binary_little_endian").replace("face", "tristrips")
    data = header.encode() + SQUARE.tobytes() + struct.pack("<B4i", 4, 0, 1, 3, 2)
    asset = read_asset("mesh.ply", data)
    assert asset.faces.tolist() == [[0, 1, 3], [3, 1, 2]]


def test_rows_of_an_off_may_be_wrapped() -> None:
    rows = "0 0\n0\n1\n0 0\n1 1 0\n0 1 0\n"
    wrapped = read_asset("mesh.off", f"OFF\n4 2 0\n{rows}4 0\n1 2\n3\n3 0\n1 2 255 0 0\n".encode())
    assert wrapped.counts().faces == 3
    assert np.array_equal(wrapped.vertices, SQUARE)


def test_comments_may_stand_anywhere_in_an_ascii_stl() -> None:
    text = seeds.ascii_stl().decode().replace("\n", " # said\n # aside\n")
    for name in ("mesh.stl", "mesh"):
        asset = read_asset(name, f"# made by hand\n{text}".encode())
        assert asset.counts().faces == 4


def test_triangles_that_are_lines_are_counted() -> None:
    """One repeats a corner, one has two corners at one place."""
    rows = "0 0 0\n1 0 0\n1 1 0\n1 0 0\n"
    asset = read_asset("mesh.off", f"OFF\n4 3 0\n{rows}3 0 1 2\n3 0 0 2\n3 0 1 3\n".encode())
    assert (asset.counts().faces, asset.collapsed, len(asset.faces)) == (3, 2, 1)


def test_rows_of_different_lengths_are_passed_over_up_to_a_cap() -> None:
    asset = read_asset("mesh.ply", ragged(500), limits=Limits(lines=1_000))
    assert asset.faces.tolist() == [[0, 1, 2]]
    with pytest.raises(LimitError, match="1,002 numbers and lists"):
        read_asset("mesh.ply", ragged(501), limits=Limits(lines=1_000))


def test_rows_of_one_length_take_no_reading_and_have_no_cap() -> None:
    data = ragged(501).replace(b"\1\7\7", b"\0\7", 1)
    asset = read_asset("mesh.ply", data, limits=Limits(lines=10))
    assert asset.faces.tolist() == [[0, 1, 2]]
