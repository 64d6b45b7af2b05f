"""Collects malformed parts of a file that say nothing of where vertices are."""

from __future__ import annotations

from dataclasses import dataclass

_KEPT = 100


@dataclass(frozen=True)
class Fault:
    """Something malformed that no viewer needs and none refuses.

    Attributes:
        place: a JSON pointer or ``line 12``.
        words: what was found, and what was expected.
    """

    place: str | None
    words: str


class Faults:
    """The first hundred faults of a file, each once."""

    def __init__(self) -> None:
        self._found: dict[Fault, None] = {}

    def note(self, place: str | None, words: str) -> None:
        """Add a fault."""
        if len(self._found) < _KEPT:
            self._found.setdefault(Fault(place, words))

    def found(self) -> tuple[Fault, ...]:
        """Those noted."""
        return tuple(self._found)
