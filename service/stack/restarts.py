"""When to start again what has ended unasked."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

from meshcone.errors import MeshConeError

FIRST_PAUSE = 0.5  # seconds
LONGEST_PAUSE = 8.0  # seconds; with a worker's 2.5 s of imports well within what is promised
HEALTHY_AFTER = 30.0  # seconds of life after which an end is the first one again

logger = logging.getLogger(__name__)


class Restarts:
    """Starts one program again and again, at once and then after pauses that double.

    It never gives up: what is missing meanwhile waits, and the rest goes on.

    Args:
        name: what to call the program in the log.
        start: starts it, without waiting until it is ready.
        ending: how it ended, in words; None as long as it runs.
        clock: seconds that only grow.

    Attributes:
        count: how often it was started again.
    """

    def __init__(
        self,
        name: str,
        start: Callable[[], None],
        ending: Callable[[], str | None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._name = name
        self._start = start
        self._ending = ending
        self._clock = clock
        self._started_at = clock()
        self._due_at: float | None = None
        self._pause = 0.0
        self.count = 0

    def look(self) -> None:
        """Start the program if it has ended and its pause is over. To be called often."""
        ending = self._ending()
        if ending is None:
            return
        if self._due_at is None:
            self._plan(f"ended ({ending})")
        if self._due_at is not None and self._clock() >= self._due_at:
            self._due_at, self._started_at = None, self._clock()
            self._try_to_start()

    def _plan(self, said: str) -> None:
        now = self._clock()
        if now - self._started_at >= HEALTHY_AFTER:
            self._pause = 0.0
        self._due_at = now + self._pause
        when = f" in {self._pause:g} s" if self._pause else ""
        logger.error("the %s %s; starting it again%s", self._name, said, when)
        self._pause = min(max(2 * self._pause, FIRST_PAUSE), LONGEST_PAUSE)

    def _try_to_start(self) -> None:
        self.count += 1
        try:
            self._start()
        except (MeshConeError, OSError) as error:
            self._plan(f"cannot be started: {error}")
