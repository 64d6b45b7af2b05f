"""A process's being asked to stop."""

from __future__ import annotations

import signal
import time
from types import FrameType

_REPEATED = 1.0  # seconds within which a second signal is the same request, sent to a group


class StopRequest:
    """Notes SIGTERM and SIGINT. Nothing is interrupted: the process looks here in between.

    The signals' handler takes no lock, as that of an event would: a second signal may arrive
    while the first is handled, and would wait for its own thread.

    Args:
        grace: seconds a job in hand may still take.
    """

    def __init__(self, grace: float) -> None:
        self._grace = grace
        self._asked_at: float | None = None
        self._at_once = False

    def listen(self) -> None:
        """Handle the signals from now on."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self.note)

    @property
    def made(self) -> bool:
        """Whether no new job is to be taken up."""
        return self._asked_at is not None

    @property
    def is_final(self) -> bool:
        """Whether the job in hand is to be handed back: asked twice, or the grace is over."""
        return self._at_once or (
            self._asked_at is not None and time.monotonic() - self._asked_at >= self._grace
        )

    def note(self, _number: int, _frame: FrameType | None) -> None:
        """Handle a signal."""
        now = time.monotonic()
        if self._asked_at is None:
            self._asked_at = now
        elif now - self._asked_at > _REPEATED:
            self._at_once = True
