"""The colours of the viewer: even to the eye, light at zero, to be seen on any ground."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from numpy.typing import NDArray

from meshcone.appearance.ciede2000 import differences, to_lab
from meshcone.srgb import to_linear
from meshcone.views.heatmap import RAMP
from service.dashboard.static_files import required

GROUNDS = {"light": (238, 241, 242), "dark": (11, 16, 19)}  # --view-back of the style sheet


def ramp(name: str) -> NDArray[np.float64]:
    """The colours of a ramp at 65 even places, linear."""
    [written] = re.findall(
        rf"export const {name} = (\[\[.*?\]\]);", required("palette.js").data.decode()
    )
    stops = np.array(json.loads(written)) / 255
    places = np.linspace(0, len(stops) - 1, 65)
    srgb = [np.interp(places, range(len(stops)), channel) for channel in stops.T]
    return np.asarray(to_linear(np.stack(srgb, axis=1)))


@pytest.mark.parametrize("name", ["COOL", "WARM"])
def test_a_ramp_is_light_at_zero_and_darker_with_each_step(name: str) -> None:
    lightness = to_lab(ramp(name))[:, 0]

    assert lightness[0] > 95
    assert (np.diff(lightness) < 0).all()


@pytest.mark.parametrize("name", ["COOL", "WARM", "HOT"])
def test_equal_steps_of_a_value_look_equal(name: str) -> None:
    colours = to_lab(ramp(name))
    steps = np.linalg.norm(np.diff(colours[::8], axis=0), axis=1)

    assert steps.max() < 1.25 * steps.min()


@pytest.mark.parametrize("ground", GROUNDS)
def test_large_values_stand_out_on_either_ground(ground: str) -> None:
    behind = to_lab(np.asarray(to_linear(np.array([GROUNDS[ground]]) / 255)))

    for name in ("COOL", "WARM", "HOT"):
        largest = to_lab(ramp(name)[-1:])
        assert differences(largest, behind)[0] > 25


def test_no_colour_beyond_the_threshold_is_like_one_below() -> None:
    below, beyond = to_lab(ramp("COOL")), to_lab(ramp("HOT"))

    nearest = min(differences(np.tile(colour, (len(below), 1)), below).min() for colour in beyond)

    assert nearest > 20


def test_the_heat_map_for_other_viewers_has_the_same_colours() -> None:
    assert np.abs(ramp("COOL")[::8] - to_linear(RAMP / 255)).max() < 1e-9
