"""One hostile file and what must be said of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True)
class Case:
    """A file that must be refused, or read in spite of what it tries.

    Attributes:
        title: what is wrong with it.
        name: its file name.
        make: makes its bytes; a bomb's are too many to keep.
        kind: of the error, or ``ok`` if the file is to be read.
        place: the error's place; a regular expression for the whole of it.
        message: a regular expression found in the error's message.
        resources: files sent along.
        limits: caps that differ from the defaults.
    """

    title: str
    name: str
    make: Callable[[], bytes]
    kind: Literal["input", "limit", "ok"]
    place: str | None = None
    message: str = ""
    resources: Mapping[str, bytes] = field(default_factory=dict)
    limits: Mapping[str, int] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.name}: {self.title}"


def constant(data: bytes | str) -> Callable[[], bytes]:
    """A maker of bytes that are known."""
    found = data.encode() if isinstance(data, str) else data
    return lambda: found
