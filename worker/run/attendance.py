"""Watching over a horse: heartbeats while it lives, and its end where that is called for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto

from redis.exceptions import RedisError

from worker.broker.patience import OutageLog
from worker.jobs.heartbeats import Heartbeats, Ownership
from worker.run.horse import Death, Horse
from worker.run.stopping import StopRequest

BEAT_INTERVAL = 1.0  # seconds; also how long a canceled job goes on
TIMEOUT_GRACE = 15.0  # seconds beyond its limit for a horse to notice, and to tell the ledger


class Cause(Enum):
    """Why an attempt ended."""

    DIED = auto()
    """The horse ended by itself, well or not."""
    OVERTIME = auto()
    CANCELED = auto()
    LOST = auto()
    """The job was taken from this attempt, and is none of its business any more."""
    STOPPED = auto()
    """The worker was asked to stop."""


@dataclass(frozen=True)
class Ending:
    """How an attempt ended."""

    cause: Cause
    death: Death


def attend(
    horse: Horse,
    job_id: str,
    attempt: int,
    *,
    heartbeats: Heartbeats,
    stop: StopRequest,
    time_limit: float,
    keep: Callable[[], None],
) -> Ending:
    """Keep an attempt alive in the ledger until its horse has ended, or has to.

    A broker that is away is waited for: the horse goes on meanwhile. ``keep`` is called at
    every look, for what the worker has to keep up besides.
    """
    deadline = time.monotonic() + time_limit + TIMEOUT_GRACE
    outage = OutageLog()
    while True:
        try:
            ownership = heartbeats.beat(job_id, attempt)
            outage.is_back()
        except RedisError as error:
            ownership = Ownership.OWNED
            outage.is_away(error)
        keep()
        cause = _cause_to_end(ownership, stop, time.monotonic() > deadline)
        # One that has just ended has, whatever else has come up.
        death = horse.wait(0.0 if cause else BEAT_INTERVAL)
        if death is not None:
            return Ending(Cause.DIED, death)
        if cause is not None:
            return Ending(cause, horse.kill())


def _cause_to_end(ownership: Ownership, stop: StopRequest, is_overtime: bool) -> Cause | None:
    if ownership is Ownership.LOST:
        return Cause.LOST
    if ownership is Ownership.CANCEL_REQUESTED:
        return Cause.CANCELED
    if is_overtime:
        return Cause.OVERTIME
    return Cause.STOPPED if stop.is_final else None
