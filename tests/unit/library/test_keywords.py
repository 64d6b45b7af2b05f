"""Options as keyword arguments."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from meshcone.errors import InputError
from meshcone.library.keywords import OptionKeywords, options_from
from meshcone.options import Options


def test_every_option_is_a_keyword() -> None:
    # The mode is the function's name, and gates are an argument of their own.
    assert set(OptionKeywords.__annotations__) == set(Options.model_fields) - {"mode", "gates"}


def test_sections_are_mappings() -> None:
    options = options_from({"effort": "fast", "surface": {"edge_cap": 3}}, "refine")

    assert options == Options(effort="fast", surface={"edge_cap": 3})


def test_dotted_names_mean_the_same_and_can_be_mixed() -> None:
    given = {"surface.edge_cap": 3, "surface": {"reach": 2}, "cones.pin.boundary": True}

    options = options_from(given, "refine")

    assert options == Options(
        surface={"edge_cap": 3, "reach": 2}, cones={"pin": {"boundary": True}}
    )


def test_numbers_and_arrays_of_numpy_are_numbers() -> None:
    given = {"seed": np.int64(3), "surface": {"fairness": np.array([3.0, 1.0])}}

    assert options_from(given, "refine") == Options(seed=3, surface={"fairness": (3.0, 1.0)})


def test_the_options_of_a_report_can_be_given_again() -> None:
    options = Options(effort="fast", surface={"edge_cap": 3})

    assert options_from(options.model_dump(), "refine") == options


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"efort": "fast"}, "unknown option 'efort'; did you mean 'effort'?"),
        ({"surface": {"edgecap": 3}}, "did you mean 'surface.edge_cap'?"),
        ({"surface.edge_cap": 3, "surface": {"edge_cap": 2}}, "'surface.edge_cap' is given twice"),
        ({"effort": "fast", "effort.x": 1}, "'effort' in 'effort.x' already has a value"),
        ({"mode": "measure"}, "use meshcone.measure instead"),
    ],
)
def test_a_wrong_option_is_an_input_error(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as error:
        options_from(given, "refine")

    assert said in str(error.value)
