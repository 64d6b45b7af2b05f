from __future__ import annotations

from pathlib import Path

import pytest

from service.problems import PROBLEM_TYPES

PAGE = (Path(__file__).parents[4] / "docs" / "api.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", PROBLEM_TYPES)
def test_every_problem_is_documented_with_its_status(name: str) -> None:
    [row] = [line for line in PAGE.splitlines() if line.startswith("|") and f"`{name}`" in line]

    assert str(PROBLEM_TYPES[name].status) in row
