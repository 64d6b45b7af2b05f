"""How often what keeps ending is started again."""

from __future__ import annotations

import logging

import pytest

from meshcone.errors import InternalError
from service.stack.restarts import HEALTHY_AFTER, LONGEST_PAUSE, Restarts


class Program:
    """Something that ends when it is told to, on a clock of its own."""

    def __init__(self) -> None:
        self.now = 0.0
        self.runs = True
        self.starts: list[float] = []
        self.can_start = True
        self.restarts = Restarts("mill", self.start, self.ending, lambda: self.now)

    def start(self) -> None:
        self.starts.append(self.now)
        if not self.can_start:
            raise InternalError("there is no water")
        self.runs = True

    def ending(self) -> str | None:
        return None if self.runs else "Killed"

    def end_and_wait(self) -> float:
        """End it, and look until it runs again; the seconds that took."""
        self.runs = False
        ended_at = self.now
        while not self.runs:
            self.restarts.look()
            self.now += 0.25
        return self.starts[-1] - ended_at


@pytest.fixture
def program() -> Program:
    return Program()


def test_what_ends_once_is_started_again_at_once(program: Program) -> None:
    assert program.end_and_wait() == 0


def test_what_keeps_ending_is_started_after_pauses_that_grow_up_to_a_longest(
    program: Program,
) -> None:
    assert [program.end_and_wait() for _ in range(7)] == [0, 0.5, 1, 2, 4, 8, LONGEST_PAUSE]


def test_a_while_of_health_makes_the_next_end_the_first(program: Program) -> None:
    for _ in range(5):
        program.end_and_wait()
    program.now += HEALTHY_AFTER

    assert program.end_and_wait() == 0


def test_what_cannot_be_started_is_tried_again_and_the_log_says_why(
    program: Program, caplog: pytest.LogCaptureFixture
) -> None:
    program.runs = program.can_start = False
    with caplog.at_level(logging.ERROR):
        for _ in range(20):
            program.restarts.look()
            program.now += 0.25
    program.can_start = True

    assert program.starts == [0, 0.5, 1.5, 3.5]
    assert "the mill cannot be started: there is no water" in caplog.text
    assert program.end_and_wait() > 0
    assert program.runs


def test_what_runs_is_left_alone(program: Program) -> None:
    program.restarts.look()

    assert program.starts == []
