"""Puts right what a death left between ledger and queue.

The ledger says which jobs are queued and which are running. A queued job no message is
about has lost it: the API died before it sent one, or a worker after it took one. A running
job without a heartbeat has lost its worker. Both are looked for every few seconds, by one
process at a time.

Nothing is done at first sight. Between two steps of a healthy process there is an instant
that looks the same, and after an outage of the broker no heartbeat is in time: what is
still so at the next look, a few seconds later, is a death.
"""

from __future__ import annotations

import logging
from collections.abc import Hashable, Set
from typing import Generic, TypeVar

from worker.jobs.errors import TransitionRefusedError, UnknownJobError
from worker.jobs.heartbeats import Heartbeats
from worker.jobs.ledger import Ledger
from worker.jobs.queue import Delivery, JobQueue
from worker.jobs.records import JobState
from worker.run.settlement import give_up_attempt, lost_worker

logger = logging.getLogger(__name__)

_LOOKED_AT = 100_000  # jobs of a state at once; more are looked at when the first are done

_NAMED = 3  # jobs in a line of the log

Sight = TypeVar("Sight", bound=Hashable)


class Reconciler:
    """Compares ledger and queue.

    Args:
        ledger: what is true.
        queue: what is to follow from it.
        heartbeats: of the attempts that are alive.
        attempts: how often a job is started at most.
    """

    def __init__(
        self, ledger: Ledger, queue: JobQueue, heartbeats: Heartbeats, attempts: int
    ) -> None:
        self._ledger = ledger
        self._queue = queue
        self._heartbeats = heartbeats
        self._attempts = attempts
        self._unattended = _Suspects[tuple[str, int]]()
        self._unheld = _Suspects[str]()
        self._stranded = _Suspects[Delivery]()

    def reconcile(self) -> None:
        """Look once, and put right what was so at the last look too. Repeatable."""
        self._give_up_the_dead()
        self._clear_stranded_messages()
        self._send_missing_messages()

    def forget(self) -> None:
        """Start afresh: the last look was too long ago, or somebody else's."""
        for suspects in (self._unattended, self._unheld, self._stranded):
            suspects.clear()

    def _give_up_the_dead(self) -> None:
        running = self._ledger.index.running(_LOOKED_AT)
        dead = {(record.id, record.attempt): record for record in self._heartbeats.missing(running)}
        for key in self._unattended.confirmed(dead.keys()):
            record = dead[key]
            try:
                state = give_up_attempt(self._ledger, record, self._attempts, lost_worker(record))
            except (TransitionRefusedError, UnknownJobError):
                continue  # it was not dead after all
            logger.warning("job %s: attempt %d lost its worker, now %s", *key, state)
            self._queue.forget_started(record.id)
            if state == "queued":
                self._queue.enqueue(record.id)

    def _clear_stranded_messages(self) -> None:
        for delivery in self._stranded.confirmed(self._queue.taken()):
            logger.warning("a worker died holding a message of job %s", delivery.job_id)
            self._queue.discard(delivery)

    def _send_missing_messages(self) -> None:
        queued = set(self._ids("queued"))  # read first: what is sent meanwhile is no suspect
        queued -= self._ledger.index.incomplete()  # nobody is to begin these
        unheld = self._unheld.confirmed(queued - self._queue.waiting())
        if unheld:  # one line: jobs that wait for a newer worker are among them at every look
            some = ", ".join(sorted(unheld)[:_NAMED])
            logger.warning("queued, but in no list: %d jobs, %s among them", len(unheld), some)
        self._queue.enqueue(*sorted(unheld))

    def _ids(self, state: JobState) -> list[str]:
        return self._ledger.index.in_state(state, _LOOKED_AT)


class _Suspects(Generic[Sight]):
    """What looked wrong at the last look."""

    def __init__(self) -> None:
        self._seen: Set[Sight] = frozenset()

    def confirmed(self, found: Set[Sight]) -> Set[Sight]:
        """What looks wrong again; the rest of what was found is kept for the next look."""
        again = found & self._seen
        self._seen = frozenset(found - again)
        return again

    def clear(self) -> None:
        self._seen = frozenset()
