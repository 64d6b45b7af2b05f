from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager

from worker.run.stopping import StopRequest


@contextmanager
def listening(grace: float) -> Iterator[StopRequest]:
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    stop = StopRequest(grace)
    stop.listen()
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def test_nothing_is_asked_at_first() -> None:
    with listening(grace=0) as stop:
        assert not stop.made
        assert not stop.is_final


def test_a_signal_asks_and_leaves_the_job_in_hand_its_grace() -> None:
    with listening(grace=60) as stop:
        os.kill(os.getpid(), signal.SIGTERM)

        assert stop.made
        assert not stop.is_final


def test_without_grace_the_job_is_handed_back_at_once() -> None:
    with listening(grace=0) as stop:
        os.kill(os.getpid(), signal.SIGTERM)

        assert stop.is_final


def test_two_signals_together_are_one_request() -> None:
    with listening(grace=60) as stop:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGTERM)

        assert not stop.is_final
