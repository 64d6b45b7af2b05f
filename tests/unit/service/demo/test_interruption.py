from __future__ import annotations

import signal
from collections.abc import Callable

import pytest

from service.demo.interruption import deferred, interruptible
from worker.run.stopping import StopRequest

SIGNALS = [signal.SIGINT, signal.SIGTERM]


def interrupted(number: signal.Signals, then: Callable[[], None]) -> None:
    with interruptible():
        signal.raise_signal(number)
        then()


def interrupted_deferred(number: signal.Signals, then: Callable[[], None]) -> None:
    with interruptible(), deferred(StopRequest(grace=0)):
        signal.raise_signal(number)
        then()


def interrupted_after_a_deferral(number: signal.Signals, then: Callable[[], None]) -> None:
    with interruptible():
        with deferred(StopRequest(grace=0)):
            pass
        signal.raise_signal(number)
        then()


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("course", [interrupted, interrupted_after_a_deferral])
def test_signal_interrupts_at_once(
    course: Callable[[signal.Signals, Callable[[], None]], None], number: signal.Signals
) -> None:
    reached: list[bool] = []
    with pytest.raises(KeyboardInterrupt):
        course(number, lambda: reached.append(True))
    assert not reached


@pytest.mark.parametrize("number", SIGNALS)
def test_deferred_signal_interrupts_at_the_end(number: signal.Signals) -> None:
    reached: list[bool] = []
    with pytest.raises(KeyboardInterrupt):
        interrupted_deferred(number, lambda: reached.append(True))
    assert reached


def test_deferred_signal_is_noted_when_it_arrives() -> None:
    noted = StopRequest(grace=0)
    with pytest.raises(KeyboardInterrupt), interruptible(), deferred(noted):
        raise_and_require(noted)


def raise_and_require(noted: StopRequest) -> None:
    signal.raise_signal(signal.SIGTERM)
    assert noted.made


def test_error_within_a_deferral_is_what_is_raised() -> None:
    def fail() -> None:
        raise OSError("no room")

    with pytest.raises(OSError, match="no room"):
        interrupted_deferred(signal.SIGINT, fail)


def test_what_the_signals_did_before_is_put_back() -> None:
    before = [signal.getsignal(number) for number in SIGNALS]
    with interruptible(), deferred(StopRequest(grace=0)):
        pass
    assert [signal.getsignal(number) for number in SIGNALS] == before
