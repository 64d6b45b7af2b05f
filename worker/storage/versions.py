"""What tells one state of a stored file from another."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Version:
    """What is under a name now.

    Attributes:
        size: bytes.
        tag: another one as soon as anything has been written there.
    """

    size: int
    tag: str
