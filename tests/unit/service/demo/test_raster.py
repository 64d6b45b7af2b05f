from __future__ import annotations

import numpy as np
import pytest

from service.demo.raster import rasterize

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
