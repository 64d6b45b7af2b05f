"""The time limit bounds every method; the clock is the test's own."""

from __future__ import annotations

from itertools import count
from typing import Any

import pytest

from meshcone.errors import SolveTimeoutError
from meshcone.options import parse_options
from meshcone.verbs.refine import refine
from tests.unit.engine.pairs import CAPPED, SETTINGS, rough, smooth

SECONDS = 1e6


def settings(name: str) -> dict[str, Any]:
    given = SETTINGS[name]
    return {**given, "solver": {**given.get("solver", {}), "time_limit": SECONDS}}


def readings(monkeypatch: pytest.MonkeyPatch, after: int) -> list[float]:
    """Let the time be over once the clock has been read a number of times; what it showed."""
    shown: list[float] = []
    numbers = count()

    def clock() -> float:
        shown.append(0.0 if next(numbers) <= after else 2 * SECONDS)
        return shown[-1]

    monkeypatch.setattr("meshcone.deadline.monotonic", clock)
    return shown


@pytest.mark.parametrize("name", SETTINGS)
def test_every_method_ends_at_the_first_reading_past_its_time(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = readings(monkeypatch, after=0)

    with pytest.raises(SolveTimeoutError, match="within"):
        refine(rough(), smooth(), parse_options(settings(name)))

    assert len(shown) == 2


@pytest.mark.parametrize("after", [5, 50, 100])
def test_the_time_may_pass_anywhere_within_the_rounds(
    after: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = readings(monkeypatch, after)

    with pytest.raises(SolveTimeoutError):
        refine(rough(), smooth(), parse_options(settings("max_displacement")))

    assert len(shown) == after + 2


def test_a_limit_that_is_far_away_changes_nothing() -> None:
    limited = {**CAPPED, "solver": {"time_limit": SECONDS}}

    made = refine(rough(), smooth(), parse_options(limited))

    assert made.data == refine(rough(), smooth(), parse_options(CAPPED)).data
