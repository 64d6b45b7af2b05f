"""Vertices that are nowhere, in PLY, STL, OFF and XYZ: what uses them is not read."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from meshcone.assets import Asset, read_asset
from meshcone.notices import Code
from tests.points import on_sphere, ply_points, xyz
from tests.unit.assets.bisecting import bisected
from tests.unit.assets.builders import CUBE, CUBE_QUADS

FACES = np.array([face for a, b, c, d in CUBE_QUADS for face in ((a, b, c), (a, c, d))])
TEXTS = {
    "ply": "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\n"
    "property float z\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n",
    "off": "OFF\n9 12 0\n",
}


def text(kind: str, nowhere: str, corner: int | None = None) -> bytes:
    """A cube and a vertex that is nowhere, which the first face uses where it is asked to."""
    rows = [" ".join(f"{value:.7f}" for value in vertex) for vertex in CUBE] + [nowhere]
    faces = FACES.copy()
    if corner is not None:
        faces[0, corner] = 8
    return (TEXTS[kind] + "\n".join([*rows, *(f"3 {a} {b} {c}" for a, b, c in faces), ""])).encode()


def told(asset: Asset) -> str:
    return next(each.words for each in asset.warnings if each.code == Code.VERTICES_ASTRAY)


@pytest.mark.parametrize("kind", ["ply", "off"])
@pytest.mark.parametrize("nowhere", ["nan nan nan", "0 -inf 0", "1 NaN 1"])
def test_one_that_no_face_uses_stays_as_it_is(kind: str, nowhere: str) -> None:
    data = text(kind, nowhere)
    asset = read_asset(f"a.{kind}", data)

    written = asset.patched(asset.vertices + 0.25)

    assert asset.faces.shape == (12, 3)
    assert "coordinates: 1; faces" in told(asset)
    assert told(asset).endswith("not drawn: 0")
    assert f"\n{nowhere}\n".encode() in written


@pytest.mark.parametrize("kind", ["ply", "off"])
def test_what_is_no_number_does_not_tell_how_numbers_are_written(kind: str) -> None:
    asset = read_asset(f"a.{kind}", text(kind, "nan nan inf"))
    assert b"\n1.2500000 1.2500000 1.2500000\n" in asset.patched(asset.vertices + 0.25)


@pytest.mark.parametrize("kind", ["ply", "off"])
def test_a_face_that_uses_one_is_not_read_and_stays(kind: str) -> None:
    asset = read_asset(f"a.{kind}", text(kind, "nan nan nan", corner=1))

    again = read_asset(f"a.{kind}", asset.patched(asset.vertices * 2))

    assert asset.faces.shape == again.faces.shape == (11, 3)
    assert told(again).endswith("not drawn: 1")
    assert again.vertices == pytest.approx(asset.vertices * 2)


def stl(encoding: str) -> bytes:
    mesh = trimesh.Trimesh(CUBE, FACES, process=False)
    if encoding == "stl":
        data = bytearray(mesh.export(file_type="stl"))
        data[96:100] = np.float32(np.nan).tobytes()
        return bytes(data)
    written = str(mesh.export(file_type="stl_ascii"))
    start = written.index("vertex") + len("vertex")
    return (written[:start] + " nan nan nan" + written[written.index("\n", start) :]).encode()


@pytest.mark.parametrize("encoding", ["stl", "stl_ascii"])
def test_a_facet_of_an_stl_with_a_corner_nowhere_stays(encoding: str) -> None:
    asset = read_asset("a.stl", stl(encoding))

    written = asset.patched(asset.vertices * 2)

    assert asset.faces.shape == (11, 3)
    assert read_asset("a.stl", written).vertices == pytest.approx(asset.vertices * 2)
    if encoding == "stl":
        assert written[84:134] == stl(encoding)[84:134]


def test_the_other_faces_can_be_divided() -> None:
    asset = read_asset("a.ply", text("ply", "nan nan nan", corner=1))

    again = read_asset("a.ply", asset.divided(bisected(asset.faces, [0, 5, 7])))

    assert len(again.faces) > 11
    assert told(again).endswith("not drawn: 1")


@pytest.mark.parametrize("kind", ["xyz", "ply"])
def test_points_that_a_scanner_has_not_seen_are_left_out(kind: str) -> None:
    points = on_sphere(300)
    grid = np.concatenate([points, np.full((20, 3), np.nan)])
    normals = np.concatenate([-points, np.full((20, 3), np.nan)])
    data = xyz(grid, normals) if kind == "xyz" else ply_points(grid, normals)

    asset = read_asset(f"scan.{kind}", data)

    assert len(asset.faces) == 300
    assert asset.counts().vertices == 320
    assert "estimated" not in asset.warnings[0].words
    assert "coordinates: 20;" in told(asset)
