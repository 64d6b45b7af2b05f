"""Textures are read as graphics hardware reads them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import map_coordinates

from meshcone.appearance.texture import sample
from meshcone.assets.content import TextureUse, placed
from meshcone.assets.content.records import Wrap
from meshcone.srgb import to_linear

USE = TextureUse("base_color", 0)
# How scipy calls what glTF calls repeat, mirror and clamp.
MODES: dict[Wrap, str] = {"repeat": "grid-wrap", "mirror": "reflect", "clamp": "nearest"}


def pixels(height: int = 5, width: int = 7) -> np.ndarray:
    return np.random.default_rng(2).integers(0, 256, (height, width, 4), dtype=np.uint8)


@pytest.mark.parametrize("wrap", MODES)
def test_texels_are_interpolated_in_linear_light(wrap: Wrap) -> None:
    image = pixels()
    linear = image / 255
    linear[..., :3] = to_linear(linear[..., :3])
    uv = np.random.default_rng(4).uniform(-2, 3, (500, 2))
    place = (uv * (7, 5) - 0.5).T[::-1]
    expected = [map_coordinates(linear[..., c], place, order=1, mode=MODES[wrap]) for c in range(4)]

    found = sample(image, replace(USE, wrap=(wrap, wrap)), uv)

    assert found == pytest.approx(np.stack(expected, axis=1), abs=1e-9)


def test_u_and_v_wrap_each_in_their_own_way() -> None:
    image = pixels()
    use = replace(USE, wrap=("clamp", "repeat"), nearest=True)

    found = sample(image, use, np.array([[1.4, 1.1], [0.99, 0.1]]))

    assert found[0] == pytest.approx(found[1])


def test_a_sampler_may_take_the_nearest_texel() -> None:
    image = pixels()

    found = sample(image, replace(USE, nearest=True), np.array([[2.9 / 7, 1.9 / 5]]))

    assert found[0, 3] == image[1, 2, 3] / 255
    assert found[0, :3] == pytest.approx(to_linear(image[1, 2, :3] / 255))


@given(
    arrays(np.float64, (4, 2), elements=st.floats(allow_nan=True, allow_infinity=True)),
    st.sampled_from(list(MODES)),
)
def test_any_coordinate_has_a_colour(uv: np.ndarray, wrap: Wrap) -> None:
    found = sample(pixels(), replace(USE, wrap=(wrap, wrap)), uv)

    assert ((found >= 0) & (found <= 1)).all()


def test_a_texture_is_scaled_then_turned_then_moved() -> None:
    use = replace(USE, scale=(2.0, 1.0), rotation=np.pi / 2, offset=(0.1, 0.2))

    # v runs down: a quarter turn counter-clockwise takes what points right upwards.
    assert placed(use, np.array([[1.0, 0.0]]))[0] == pytest.approx((0.1, -1.8))
    assert placed(use, np.array([[0.0, 1.0]]))[0] == pytest.approx((1.1, 0.2))
