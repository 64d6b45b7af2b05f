"""What a job is told whose temporary files find no room."""

from __future__ import annotations

import shutil
from typing import NamedTuple

import pytest

from meshcone.errors import LimitError
from worker.run.task import DiskFullError, full_disk


class Usage(NamedTuple):
    total: int
    used: int
    free: int


@pytest.fixture
def free(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """What is free of the 100 bytes of a disk."""
    found = [0]
    monkeypatch.setattr(shutil, "disk_usage", lambda _place: Usage(100, 100 - found[0], found[0]))
    return found


def test_one_that_others_have_filled_is_waited_for(free: list[int]) -> None:
    free[0] = 10

    with pytest.raises(DiskFullError):
        full_disk()


def test_one_that_the_job_alone_has_filled_is_its_limit(free: list[int]) -> None:
    free[0] = 90

    error = full_disk()

    assert isinstance(error, LimitError)
    assert "more than the 90 bytes" in str(error)
