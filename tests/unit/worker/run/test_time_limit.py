from __future__ import annotations

import signal
import time
from contextlib import suppress

import pytest

from worker.run.time_limit import TimeLimitReached, time_limit


def test_work_that_takes_too_long_is_interrupted() -> None:
    with pytest.raises(TimeLimitReached), time_limit(0.05):
        time.sleep(30)


def test_no_except_exception_swallows_the_interruption() -> None:
    with pytest.raises(TimeLimitReached), time_limit(0.05), suppress(Exception):
        time.sleep(30)


def test_work_that_is_done_in_time_is_left_alone() -> None:
    with time_limit(30):
        done = True

    assert done
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
