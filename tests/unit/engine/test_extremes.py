"""No legal option ends in an internal error: the ends of each range, alone and together.

The ranges are read from the options' own JSON schema: an option that is added is tried too.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cache
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshcone.errors import InfeasibleError, InputError, LimitError, SolveTimeoutError
from meshcone.options import Options, parse_options
from meshcone.verbs.refine import refine
from tests.unit.engine.pairs import rough, smooth

Path = tuple[str, ...]
# With a reason; any other error is a fault.
REASONS = (InputError, InfeasibleError, LimitError, SolveTimeoutError)
FEW = {"samples": 16, "emd_samples": 16, "curvature_samples": 16}
# Whose largest number takes seconds: each is tried alone and left out of the combinations.
LONG = set(FEW)


@cache
def numbers() -> dict[Path, dict[str, Any]]:
    """Every numeric option's schema, by its path; a list's items count as the list's."""
    schema = Options.model_json_schema()
    found: dict[Path, dict[str, Any]] = {}

    def visit(node: dict[str, Any], path: Path) -> None:
        if "$ref" in node:
            visit(schema["$defs"][node["$ref"].rsplit("/", 1)[1]], path)
        for choice in node.get("anyOf", ()):
            visit(choice, path)
        for name, child in node.get("properties", {}).items():
            visit(child, (*path, name))
        for name in ("items", "additionalProperties"):
            if isinstance(node.get(name), dict):
                visit(node[name], (*path, f"<{name}>"))
        if node.get("type") in ("integer", "number"):
            found[path] = node

    visit(schema, ())
    return found


ENDS = [(path, end) for path in numbers() for end in ("minimum", "maximum")]
NAMES = [f"{'.'.join(path)} {end}" for path, end in ENDS]


def document(path: Path, value: float) -> dict[str, Any]:
    """Return the least document that sets one number, of the formulation that reads it."""
    made: Any = value
    for name in reversed(path):
        if name == "<items>":
            made = [made]
        else:
            made = {"point_to_surface.p95" if name.startswith("<") else name: made}
    formulation = "centroid" if path[0] == "centroid" else "surface"
    return merged({"effort": "fast", "formulation": formulation, "quality": FEW}, made)


def merged(into: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    both = {**into, **new}
    for name in into.keys() & new.keys():
        if isinstance(into[name], dict) and isinstance(new[name], dict):
            both[name] = merged(into[name], new[name])
    return both


def answered(given: dict[str, Any]) -> None:
    """Refine a small mesh; the answer is finite, or its absence has a reason."""
    with suppress(*REASONS):
        made = refine(rough(), smooth(), parse_options(given))
        assert made.report.displacement.max < float("inf")
        made.report.model_dump_json()
        refined = made.report.quality.refined.model_dump()
        assert all(abs(value) < float("inf") for value in floats(refined))


def floats(value: Any) -> list[float]:
    if isinstance(value, dict):
        return [number for child in value.values() for number in floats(child)]
    return [value] if isinstance(value, float) else []


@pytest.mark.parametrize("path", numbers(), ids=".".join)
def test_every_number_has_both_ends(path: Path) -> None:
    assert numbers()[path].keys() >= {"minimum", "maximum"}


@pytest.mark.parametrize("path", numbers(), ids=".".join)
@pytest.mark.parametrize("value", [1e308, -1e308, float("inf"), float("nan")])
def test_what_is_beyond_both_ends_is_refused(path: Path, value: float) -> None:
    with pytest.raises(InputError):
        parse_options(document(path, value))


@pytest.mark.parametrize(("path", "end"), ENDS, ids=NAMES)
def test_each_end_alone_gives_an_answer_or_a_reason(path: Path, end: str) -> None:
    answered(document(path, numbers()[path][end]))


@pytest.mark.parametrize("fairness", [[0, 0], [1e6, 1e6]])
@pytest.mark.parametrize("tangential", [1e-6, 1e6])
@pytest.mark.parametrize("proximity", [1e-6, 1e6])
def test_weights_together_give_an_answer_or_a_reason(
    fairness: list[float], tangential: float, proximity: float
) -> None:
    weights = {"fairness": fairness, "tangential": tangential, "proximity": proximity}
    answered({"effort": "fast", "quality": FEW, "surface": weights})


COMBINED = [(path, end) for path, end in ENDS if path[-1] not in LONG]


@given(
    ends=st.lists(st.sampled_from(COMBINED), min_size=2, max_size=6, unique_by=lambda e: e[0]),
    align=st.sampled_from(["none", "rigid", "similarity"]),
    method=st.sampled_from(["active", "full"]),
)
@settings(max_examples=30, deadline=None, derandomize=True)
def test_ends_together_give_an_answer_or_a_reason(
    ends: list[tuple[Path, str]], align: str, method: str
) -> None:
    given: dict[str, Any] = {"align": align, "solver": {"method": method}}
    for path, end in ends:
        given = merged(given, document(path, numbers()[path][end]))
    answered(given)


@pytest.mark.parametrize(
    "surface",
    [
        {"fairness": [0, 0], "tangential": 1e-12, "proximity": 1e-12},
        {"fairness": [1e308], "proximity": 1e308},
        {"edge_cap": 1e9},
        {"edge_cap": 0.5},
    ],
)
def test_weights_beyond_all_digits_are_refused(surface: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="should be"):
        parse_options({"surface": surface})
