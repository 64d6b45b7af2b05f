"""Files of points without faces."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import Asset, Limits, read_asset
from meshcone.assets.points.normals import estimated_normals, spacing_of
from meshcone.errors import InputError, LimitError
from meshcone.notices import Code
from tests.points import on_sphere, ply_points, xyz


def centres(asset: Asset) -> np.ndarray:
    return asset.vertices[asset.faces].mean(axis=1)


def directions(asset: Asset) -> np.ndarray:
    a, b, c = np.moveaxis(asset.vertices[asset.faces], 1, 0)
    found = np.cross(b - a, c - a)
    return found / np.linalg.norm(found, axis=1, keepdims=True)


@pytest.mark.parametrize("kind", ["xyz", "ply"])
def test_each_point_is_where_the_file_has_it(kind: str) -> None:
    points = on_sphere(500)
    data = xyz(points) if kind == "xyz" else ply_points(points)

    asset = read_asset(f"scan.{kind}", data)

    assert (asset.format, asset.is_points) == (kind, True)
    assert np.abs(centres(asset) - points).max() <= asset.tolerance < 1e-5
    assert (asset.counts().vertices, asset.counts().faces) == (500, 0)
    [notice] = asset.warnings
    assert notice.code == Code.SURFACE_POINTS
    assert "estimated" in notice.words


@pytest.mark.parametrize("kind", ["xyz", "ply"])
def test_normals_of_the_file_are_taken(kind: str) -> None:
    points = on_sphere(300)
    data = xyz(points, -points) if kind == "xyz" else ply_points(points, -points)

    asset = read_asset(f"scan.{kind}", data)

    assert np.allclose(directions(asset), -points, atol=1e-4)
    assert "estimated" not in asset.warnings[0].words


def test_colours_after_a_point_are_no_normals() -> None:
    points = on_sphere(300)

    asset = read_asset("scan.xyz", xyz(points, np.full((300, 3), 128.0)))

    assert (directions(asset) * points).sum(axis=1).min() > 0.9


def test_estimated_normals_point_outside_of_every_piece() -> None:
    points = on_sphere(2000)
    apart = np.concatenate([points, 0.5 * points + [5.0, 0, 0]])

    found = estimated_normals(apart)

    assert (found * np.concatenate([points, points])).sum(axis=1).min() > 0.95


def test_the_gap_between_points_is_stated() -> None:
    grid = np.stack(np.meshgrid(*2 * [np.arange(9.0)], [0.0]), axis=-1).reshape(-1, 3)

    assert spacing_of(grid * 0.25) == 0.25


def test_an_xyz_may_have_comments_a_count_commas_and_windows_line_ends() -> None:
    text = b"# a scan\r\n4\r\n0,0,0\r\n\r\n1,0,0\r\n// more\r\n0,1,0\r\n0,0,1\r\n"

    assert np.allclose(centres(read_asset("a.xyz", text)).max(axis=0), 1)


def test_numbers_of_an_xyz_may_have_any_length() -> None:
    points = on_sphere(50) * 1e-7
    long = "".join(f"{x:.40e} {y:.40e} {z:.40e}\n" for x, y, z in points).encode()

    assert np.allclose(centres(read_asset("a.xyz", long)), points, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"0 0 0\n1 0\n", "line 2: expected 3, as on the first numbers, found 2"),
        (b"0 0\n1 0\n", "line 1: expected 3 or more numbers, found 2"),
        (b"0 0 0\n\n1 x 0\n", "line 3: expected a number, found 'x'"),
        (b"0 0 0\n1 0 0\n0 1_0 0\n0 0 1\n", "line 3: expected a number, found '1_0'"),
        (b"0,5 1,5 2,5\n", "line 1: .*decimal commas"),
        (b"0.5;1.5;2.5\n0,5;1,5;2,5\n", "line 2: .*decimal commas"),
        (b"0 0 0\n1 nan 0\n", "no faces, and 1 distinct points"),
        (b"# nothing\n", "the file holds no points"),
        (b"0 0 0\n1 0 0\n1 0 0\n0 1 0\n", "no faces, and 3 distinct points"),
    ],
)
def test_what_is_no_cloud_is_refused_with_its_line(text: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_asset("a.xyz", text)


def test_points_count_against_the_limit_of_vertices() -> None:
    with pytest.raises(LimitError, match=r"101 points.*MESHCONE_LIMIT_VERTICES"):
        read_asset("a.xyz", xyz(on_sphere(101)), limits=Limits(vertices=100))


def test_points_cannot_be_written() -> None:
    with pytest.raises(InputError, match="it can be a reference alone"):
        read_asset("a.xyz", xyz(on_sphere(50))).ensure_writable()
