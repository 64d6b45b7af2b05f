from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from meshcone.views.raster import OverdrawError, both_ends, rasterize

SIZE = 16

# Two triangles over the same corner of the image; y points down, so that these, which run
# clockwise on the page, face the viewer.
CORNER = np.array([[1.0, 1.0], [1.0, 13.0], [13.0, 1.0]])


def at_depth(depth: float) -> np.ndarray:
    return np.column_stack([CORNER, np.full(3, depth)])


@pytest.mark.parametrize("depths", [(1.0, 2.0), (2.0, 1.0)])
def test_the_nearer_triangle_is_seen(depths: tuple[float, float]) -> None:
    points = np.concatenate([at_depth(depth) for depth in depths])
    seen = rasterize(points, np.array([[0, 1, 2], [3, 4, 5]]), SIZE)
    assert set(seen.faces) == {int(np.argmax(depths))}


def test_a_triangle_seen_from_behind_is_not_drawn() -> None:
    seen = rasterize(at_depth(0), np.array([[0, 2, 1]]), SIZE)
    assert len(seen.pixels) == 0


def test_each_pixel_is_seen_once_and_inside_the_triangle() -> None:
    seen = rasterize(at_depth(0), np.array([[0, 1, 2]]), SIZE)
    row, column = np.divmod(seen.pixels, SIZE)
    assert len(set(seen.pixels)) == len(seen.pixels)
    assert len(seen.pixels) == pytest.approx(12 * 12 / 2, abs=12)
    assert (row + column + 1 <= 14).all()


def test_values_are_interpolated_at_the_pixels_centres() -> None:
    faces = np.array([[0, 1, 2]])
    seen = rasterize(at_depth(0), faces, SIZE)
    row, column = np.divmod(seen.pixels, SIZE)
    centres = np.stack([column + 0.5, row + 0.5], axis=1)
    assert seen.interpolate(CORNER, faces) == pytest.approx(centres)


def test_what_lies_beyond_the_image_is_cut_off() -> None:
    seen = rasterize(at_depth(0) + np.array([8, 8, 0]), np.array([[0, 1, 2]]), SIZE)
    assert len(seen.pixels) > 0
    assert seen.pixels.max() < SIZE * SIZE


@given(arrays(np.float64, (6, 3, 3), elements=st.floats(-4, 20, width=16)))
def test_both_ends_are_those_of_all_triangles_over_a_pixel(corners: np.ndarray) -> None:
    points, faces = corners.reshape(-1, 3), np.arange(18).reshape(6, 3)

    nearest, farthest = both_ends(points, faces, SIZE)

    for pixel in range(SIZE * SIZE):
        row, column = divmod(pixel, SIZE)
        depths = [depth for each in corners for depth in depth_at(each, column + 0.5, row + 0.5)]
        # On an edge rounding decides.
        edges = [
            depth for each in corners for depth in depth_at(each, column + 0.5, row + 0.5, -1e-6)
        ]
        for seen, end in ((nearest, max), (farthest, min)):
            found = np.flatnonzero(seen.pixels == pixel)
            if depths and len(found):
                face, weights = seen.faces[found[0]], seen.weights[found[0]]
                shown = float(weights @ corners[face, :, 2])
                low, high = sorted([end(depths), end(edges)])
                assert low - 1e-3 <= shown <= high + 1e-3
            elif depths:
                raise AssertionError("a pixel inside a triangle was missed")


def depth_at(corners: np.ndarray, x: float, y: float, margin: float = 1e-6) -> list[float]:
    """The depth of a triangle at a point inside it by a margin; nothing elsewhere."""
    system = np.vstack([corners[:, :2].T, np.ones(3)])
    if abs(np.linalg.det(system)) < 1e-2:
        return []
    weights = np.linalg.solve(system, [x, y, 1])
    return [float(weights @ corners[:, 2])] if weights.min() > margin else []


def test_triangles_that_cover_everything_too_often_are_refused() -> None:
    whole = np.array([[-400.0, -400, 0], [-400, 2000, 0], [2000, -400, 0]])

    with pytest.raises(OverdrawError):
        rasterize(whole, np.tile([0, 1, 2], (800, 1)), 400)
