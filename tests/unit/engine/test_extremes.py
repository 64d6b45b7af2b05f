"""No legal option ends in an internal error: the ends of each range, alone and together."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest

from meshcone.errors import InfeasibleError, InputError
from meshcone.options import parse_options
from meshcone.verbs.refine import refine
from tests.unit.engine.pairs import rough, smooth

WEIGHTS = ("tangential", "proximity", "reverse", "noise_scale", "reach", "fairness_knee")


def ends(key: str) -> list[float]:
    return [0.0 if key == "reverse" else 1e-6, 1e6]


def refined(surface: dict[str, Any]) -> None:
    options = parse_options({"effort": "fast", "surface": surface})
    with suppress(InputError, InfeasibleError):  # with a reason; any other error is a fault
        made = refine(rough(), smooth(), options)
        assert made.report.displacement.max < float("inf")


@pytest.mark.parametrize(("key", "value"), [(key, end) for key in WEIGHTS for end in ends(key)])
def test_the_ends_of_each_range_give_an_answer_or_a_reason(key: str, value: float) -> None:
    refined({key: value})


@pytest.mark.parametrize("fairness", [[0, 0], [1e6, 1e6]])
@pytest.mark.parametrize("tangential", [1e-6, 1e6])
@pytest.mark.parametrize("proximity", [1e-6, 1e6])
def test_ends_together_give_an_answer_or_a_reason(
    fairness: list[float], tangential: float, proximity: float
) -> None:
    refined({"fairness": fairness, "tangential": tangential, "proximity": proximity})


@pytest.mark.parametrize(
    "surface",
    [
        {"fairness": [0, 0], "tangential": 1e-12, "proximity": 1e-12},
        {"fairness": [1e308], "proximity": 1e308},
        {"edge_cap": 1e9},
    ],
)
def test_weights_beyond_all_digits_are_refused(surface: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="should be"):
        parse_options({"surface": surface})
