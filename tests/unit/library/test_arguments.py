"""Arguments that are of no use are refused in words."""

from __future__ import annotations

from typing import Any

import pytest

import meshcone
from meshcone.errors import ArgumentError, InputError
from tests.unit.library.meshes import rough, smooth


@pytest.mark.parametrize("option", ["name", "profile"])
def test_names_are_text(option: str) -> None:
    given: Any = {option: 5}

    with pytest.raises(ArgumentError, match=f"'{option}' must be text, found a value of type int"):
        meshcone.gate(rough(), smooth(), gates={"chamfer": {"max": 1}}, **given)


def test_the_name_of_a_mesh_is_text() -> None:
    name: Any = 5

    with pytest.raises(ArgumentError, match="'name' must be text"):
        meshcone.load(rough(), name=name)


def test_a_number_of_processes_is_a_whole_number_of_one_or_more() -> None:
    two: Any = "2"

    with pytest.raises(ArgumentError, match=r"'processes' must be a whole number, found .* str"):
        meshcone.refine(rough(), smooth(), processes=two)
    with pytest.raises(InputError, match="'processes' must be 1 or more, found 0"):
        meshcone.refine(rough(), smooth(), processes=0)


@pytest.mark.parametrize(
    ("accepted", "percentile", "said"),
    [
        ([], 99, "expected a mapping of names to results, found a value of type list"),
        ({"a": 3}, 99, "a: expected what meshcone.measure or .* found a value of type int"),
        ({}, "x", "'percentile' must be a number, found a value of type str"),
    ],
)
def test_thresholds_are_proposed_from_results(accepted: Any, percentile: Any, said: str) -> None:
    with pytest.raises(ArgumentError, match=said):
        meshcone.thresholds(accepted, percentile)
