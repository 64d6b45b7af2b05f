from __future__ import annotations

import io
import struct

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.errors import InputError, LimitError
from tests.unit.assets.builders import CUBE, cube_gltf, cube_obj

TRIANGLES = [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)]
TETRAHEDRON = CUBE[[0, 1, 2, 4]]


def stl() -> bytes:
    rows = [struct.pack("<12fH", 0, 0, 0, *TETRAHEDRON[list(t)].ravel(), 0) for t in TRIANGLES]
    return bytes(80) + struct.pack("<I", len(rows)) + b"".join(rows)


def ply(vertices: int = 4) -> bytes:
    header = (
        f"ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n"
        "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = [" ".join(map(str, vertex)) for vertex in TETRAHEDRON]
    rows += [f"3 {a} {b} {c}" for a, b, c in TRIANGLES]
    return (header + "\n".join(rows) + "\n").encode()


def off(vertices: int = 4) -> bytes:
    rows = [" ".join(map(str, vertex)) for vertex in TETRAHEDRON]
    rows += [f"3 {a} {b} {c}" for a, b, c in TRIANGLES]
    return (f"OFF\n{vertices} 4 0\n" + "\n".join(rows) + "\n").encode()


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (cube_obj(), "obj"),
        (cube_gltf().glb(), "glb"),
        (cube_gltf().embedded(), "gltf"),
        (stl(), "stl"),
        (ply(), "ply"),
        (off(), "off"),
    ],
)
def test_content_decides_the_format_whatever_the_name(data, kind):
    assert read_asset("upload", data).format == kind


@pytest.mark.parametrize("data", [stl(), ply(), off()])
def test_foreign_formats_are_welded(data):
    asset = read_asset("reference", data)
    assert (len(asset.vertices), len(asset.faces)) == (4, 4)


@pytest.mark.parametrize("data", [ply(10**9), off(10**9)])
def test_a_huge_declared_size_is_refused_before_it_is_read(data):
    with pytest.raises(LimitError, match="1,000,000,000 vertices"):
        read_asset("reference", data)


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.obj", b"", "the file is empty"),
        ("a.obj", b" \r\n\0", "the file is empty"),
        ("a.fbx", b"", "is empty, and files named '.fbx' are not read here; expected OBJ"),
        ("a.fbx", b"; FBX 7.3.0 project file", "this is an FBX file"),
        ("a.zip", b"PK\3\4....", "the archive was cut short"),
        ("a.fbx", b"Kaydara FBX Binary  \0", "this is an FBX file"),
        ("a.dae", b"<?xml version='1.0'?>", "an XML or HTML document"),
        ("a.glb", b"nothing like it", "does not start with 'glTF'"),
        ("a.gltf", b"[]", "does not start with a JSON object"),
        ("a.txt", b"Dear reader", "not a known kind of mesh file"),
    ],
)
def test_other_files_are_refused_by_what_they_are(name, data, message):
    with pytest.raises(InputError, match=message) as caught:
        read_asset(name, data)
    assert caught.value.file == name


def test_positions_agree_with_numpy_text_parsing():
    points = np.random.default_rng(1).normal(size=(50, 3))
    text = io.StringIO()
    np.savetxt(text, points, fmt="v %.17g %.17g %.17g")
    faces = "".join(f"f {k + 1} {k + 2} {k + 3}\n" for k in range(48))
    asset = read_asset("a.obj", (text.getvalue() + faces).encode())
    assert np.array_equal(asset.positions, points)


def test_a_limit_that_is_no_number_is_named_in_one_line(monkeypatch):
    monkeypatch.setenv("MESHCONE_LIMIT_VERTICES", "many")
    with pytest.raises(InputError, match=r"^environment variable MESHCONE_LIMIT_VERTICES: [^\n]+$"):
        read_asset("cube.obj", cube_obj())


def test_an_empty_limit_is_not_set(monkeypatch):
    monkeypatch.setenv("MESHCONE_LIMIT_VERTICES", "")
    assert read_asset("cube.obj", cube_obj()).counts().vertices == 8


@pytest.mark.parametrize("name", ["a.glb", "a.gltf"])
def test_an_obj_is_read_whatever_it_is_called(name: str) -> None:
    assert read_asset(name, cube_obj()).format == "obj"
