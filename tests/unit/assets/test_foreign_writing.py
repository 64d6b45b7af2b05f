"""PLY, STL and OFF are written back with the numbers of moved vertices alone changed."""

from __future__ import annotations

import io
from itertools import permutations
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from meshcone.assets import Asset, WritePolicy, read_asset
from meshcone.errors import InputError
from tests import meshes
from tests.fuzz import seeds

BALL = meshes.sphere(2)
KEEP = WritePolicy(normals="keep")


def exported(kind: str, **options: Any) -> bytes:
    mesh = trimesh.Trimesh(BALL.vertices, BALL.faces, process=False)
    mesh.visual.vertex_colors = np.arange(4 * len(BALL.vertices), dtype=np.uint8).reshape(-1, 4)
    data = mesh.export(file_type=kind, **options)
    return data.encode() if isinstance(data, str) else data


FILES = {
    "binary.ply": exported("ply", vertex_normal=True),
    "ascii.ply": exported("ply", encoding="ascii", vertex_normal=True),
    "big.ply": seeds.ply("binary_big_endian"),
    "mixed.ply": seeds.mixed_ply(),
    "binary.stl": exported("stl"),
    "ascii.stl": exported("stl_ascii"),
    "plain.off": exported("off", digits=9),
    "normals.off": b"NOFF # a\n3 1 0\n0 0 0 0 0\n1\n1 0 0 0 0 1 # b\n0 1 0 0 0 1\n3 0 1 2 9 9 9\n",
}


def theirs(name: str, data: bytes) -> NDArray[np.float64]:
    """(m, 3, 3) corners of the triangles, as trimesh reads them."""
    mesh = trimesh.load_mesh(io.BytesIO(data), file_type=name[-3:], process=False)
    return np.asarray(mesh.triangles)


def drifted(asset: Asset) -> NDArray[np.float64]:
    return asset.vertices + np.random.default_rng(3).uniform(-0.1, 0.1, asset.vertices.shape)


@pytest.mark.parametrize("name", FILES)
def test_where_nothing_moves_nothing_changes(name: str) -> None:
    asset = read_asset(name, FILES[name])
    assert asset.patched(asset.vertices) == FILES[name]


@pytest.mark.parametrize("name", FILES)
def test_vertices_are_where_they_were_moved_to(name: str) -> None:
    asset = read_asset(name, FILES[name])
    target = drifted(asset)
    again = read_asset(name, asset.patched(target))
    assert np.allclose(again.positions, target[asset.weld], atol=1e-6)
    assert np.array_equal(again.triangles, asset.triangles)


@pytest.mark.parametrize("name", ["binary.ply", "ascii.ply", "binary.stl", "ascii.stl"])
def test_others_read_what_was_written_as_it_was_meant(name: str) -> None:
    asset = read_asset(name, FILES[name])
    target = drifted(asset)
    found = theirs(name, asset.patched(target))
    assert np.allclose(found, target[asset.faces], atol=1e-6)


def parted(name: str, data: bytes) -> tuple[bytes, NDArray[Any], bytes]:
    """What comes before a binary file's table of vertices, the table, and what comes after."""
    if name.endswith("ply"):
        row = np.dtype([("place", "<f4", 3), ("normal", "<f4", 3), ("colour", "u1", 4)])
        start, count = data.index(b"end_header\n") + 11, len(BALL.vertices)
    else:
        row = np.dtype([("normal", "<f4", 3), ("place", "<f4", (3, 3)), ("attribute", "<u2")])
        start, count = 84, len(BALL.faces)
    end = start + count * row.itemsize
    return data[:start], np.frombuffer(data[start:end], row), data[end:]


@pytest.mark.parametrize("name", ["binary.ply", "binary.stl"])
def test_of_binary_files_only_coordinates_change(name: str) -> None:
    asset = read_asset(name, FILES[name])
    head, before, tail = parted(name, FILES[name])
    written = parted(name, asset.patched(drifted(asset), KEEP))
    assert (written[0], written[2]) == (head, tail)
    for field in before.dtype.names or ():
        assert np.array_equal(written[1][field], before[field]) == (field != "place")


def test_of_text_only_coordinates_that_change_are_written_anew() -> None:
    text = b"OFF # a\n\n# b\n3 1 0\n 0  0.50\t0 7 7\r\n1 0\n0 # c\n0 1 0\n3 0 1 2 9 # d\n"
    asset = read_asset("mesh.off", text)
    moved = asset.vertices + np.array([[0, 0, 1], [0, 0, 0], [0, 0.25, 0]])
    assert asset.patched(moved) == text.replace(b"0.50\t0 7", b"0.50\t1 7").replace(
        b"0 1 0\n3", b"0 1.25 0\n3"
    )


def test_normals_of_a_ply_follow_its_surface() -> None:
    for name in ("binary.ply", "ascii.ply"):
        asset = read_asset(name, FILES[name])
        stretched = trimesh.load_mesh(
            io.BytesIO(asset.patched(asset.vertices * (1, 1, 3))),
            file_type="ply",
            process=False,
        )
        mine = np.asarray(stretched.vertex_normals)
        exact = BALL.vertices / (1, 1, 3)
        exact /= np.linalg.norm(exact, axis=1, keepdims=True)
        assert np.einsum("ij,ij->i", mine, exact).min() > 0.9


@pytest.mark.parametrize("name", ["binary.stl", "ascii.stl"])
def test_facets_of_an_stl_get_the_normals_of_their_triangles(name: str) -> None:
    asset = read_asset(name, FILES[name])
    target = drifted(asset)
    corners = target[asset.faces]
    expected = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.allclose(facet_normals(asset.patched(target)), expected, atol=1e-3)
    kept = facet_normals(asset.patched(target, KEEP))
    assert np.array_equal(kept, facet_normals(FILES[name]))


def facet_normals(data: bytes) -> NDArray[np.float64]:
    if data.startswith(b"solid"):
        lines = [line.split() for line in data.decode().splitlines() if "facet normal" in line]
        return np.array([[float(word) for word in line[2:5]] for line in lines])
    table = np.frombuffer(data, "<3f4, (3,3)<f4, <u2", offset=84)
    return table["f0"].astype(float)


def test_normals_that_are_zero_stay_zero() -> None:
    data = bytearray(FILES["binary.stl"])
    data[84:96] = bytes(12)
    asset = read_asset("mesh.stl", bytes(data))
    normals = facet_normals(asset.patched(drifted(asset)))
    assert not normals[0].any()
    assert normals[1:].any(axis=1).all()


def test_coordinates_that_do_not_fit_their_type_are_refused() -> None:
    text = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar x\n"
    text += "property uchar y\nproperty uchar z\nelement face 1\n"
    text += "property list uchar uchar vertex_indices\nend_header\n"
    data = text.encode() + bytes([0, 0, 0, 200, 0, 0, 0, 200, 0, 3, 0, 1, 2])
    asset = read_asset("mesh.ply", data)
    assert read_asset("m.ply", asset.patched(asset.vertices + 20)).vertices.min() == 20
    with pytest.raises(InputError, match="does not fit uint8"):
        asset.patched(asset.vertices + 60)


def test_lists_before_the_vertices_are_in_the_way() -> None:
    text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    text += "property list uchar int of\nproperty float z\nelement face 1\n"
    text += "property list uchar int vertex_indices\nend_header\n"
    text += "0 0 1 5 0\n1 0 0 0\n0 1 0 0\n3 0 1 2\n"
    asset = read_asset("mesh.ply", text.encode())
    with pytest.raises(InputError, match="can be a reference, not a source"):
        asset.ensure_writable()


def reordered(names: list[str]) -> bytes:
    """The ball as an ASCII PLY whose header names coordinates and normals in a certain order."""
    header = ["ply", "format ascii 1.0", f"element vertex {len(BALL.vertices)}"]
    header += [f"property double {name}" for name in names]
    header += [f"element face {len(BALL.faces)}", "property list uchar int vertex_indices"]
    rows = BALL.vertices[:, ["xyz".index(name[-1]) for name in names]]
    lines = [" ".join(f"{value:.9g}" for value in row) for row in rows]
    lines += [f"3 {a} {b} {c}" for a, b, c in BALL.faces]
    return "\n".join([*header, "end_header", *lines, ""]).encode()


@pytest.mark.parametrize("axes", ["".join(axes) for axes in permutations("xyz")])
def test_coordinates_and_normals_of_a_text_may_stand_in_any_order(axes: str) -> None:
    data = reordered([prefix + axis for axis in axes for prefix in ("", "n")])
    asset = read_asset("mesh.ply", data)
    target = asset.vertices * (1, 1.5, 3)

    written = asset.patched(target)

    mesh = trimesh.load_mesh(io.BytesIO(written), file_type="ply", process=False)
    assert np.allclose(mesh.vertices, target[asset.weld], atol=1e-7)
    normals = BALL.vertices / (1, 1.5, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.einsum("ij,ij->i", mesh.vertex_normals, normals).min() > 0.9
    words = [[len(line.split()) for line in text.splitlines()] for text in (written, data)]
    assert words[0] == words[1]


def test_a_normal_that_a_row_has_a_part_of_stays_as_it_is() -> None:
    lines = reordered(["x", "y", "z", "nx", "ny", "nz"]).split(b"\n")
    first = lines.index(b"end_header") + 1
    lines[first] = b" ".join(lines[first].split()[:4])
    asset = read_asset("mesh.ply", b"\n".join(lines))

    written = asset.patched(asset.vertices * (1, 1.5, 3)).split(b"\n")[first]

    assert written.split()[3:] == lines[first].split()[3:]
