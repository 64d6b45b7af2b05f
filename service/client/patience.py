"""How a client waits for a service that cannot answer just now."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

_FIRST_PAUSE = 0.25  # seconds
_LONGEST_PAUSE = 10.0  # seconds
_SPREAD = 0.25  # share of a pause, so that many clients do not come back at one time


@dataclass
class Patience:
    """The time one call may spend on pauses.

    Args:
        seconds: of it, in all.
        sleep: waits.
    """

    seconds: float
    sleep: Callable[[float], None] = time.sleep
    _tries: int = field(default=0, init=False)

    def pause(self, headers: Mapping[str, str] | None = None) -> bool:
        """Wait as long as ``Retry-After`` says, or a little longer each time.

        Returns:
            Whether to try again; false, at once, if there is not that much time left.
        """
        wanted = _asked_for(headers or {})
        if wanted is None:
            wanted = min(_FIRST_PAUSE * 2**self._tries, _LONGEST_PAUSE)
        # Never earlier than was asked for.
        wanted *= 1 + random.uniform(0, _SPREAD)  # noqa: S311 - nothing is kept secret by it
        if wanted > self.seconds:
            return False
        self._tries += 1
        self.seconds -= wanted
        self.sleep(wanted)
        return True


def _asked_for(headers: Mapping[str, str]) -> float | None:
    value = headers.get("retry-after", "")  # this service gives seconds, never a date
    return float(value) if value.isdecimal() else None
