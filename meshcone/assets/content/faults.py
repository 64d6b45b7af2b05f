"""Collects malformed parts of a file that say nothing of where vertices are."""

from __future__ import annotations

from meshcone.assets.content.records import Fault

_KEPT = 100


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
