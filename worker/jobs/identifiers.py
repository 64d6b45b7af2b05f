"""Names of jobs, and of the projects they belong to."""

from __future__ import annotations

import re
import secrets
import time
import uuid
from collections.abc import Iterator

_RANDOM_BITS = 74  # of a UUID of version 7, beside time, version and variant
_STEP_BITS = 44


def new_job_id() -> str:
    """A UUID of version 7 (RFC 9562, section 5.7): unguessable, and sorting by creation time."""
    return next(ids_in_order())


def ids_in_order() -> Iterator[str]:
    """Such ids of one moment, each sorting after the last.

    The second method of RFC 9562, section 6.2: each is the last one plus a random number, so that
    who knows one can guess no other.
    """
    milliseconds = time.time_ns() // 1_000_000 & (2**48 - 1)
    number = secrets.randbits(_RANDOM_BITS - 1)
    while True:
        high, low = number >> 62, number & (2**62 - 1)
        yield str(uuid.UUID(int=milliseconds << 80 | 0x7 << 76 | high << 64 | 0x2 << 62 | low))
        number += 1 + secrets.randbits(_STEP_BITS)


def earliest_id(seconds: float) -> str:
    """What ids of jobs and batches that are made from a time on sort after."""
    return str(uuid.UUID(int=round(seconds * 1000) << 80))


def is_job_id(text: str) -> bool:
    """Whether ``text`` is spelled as :func:`new_job_id` spells one."""
    try:
        return str(uuid.UUID(text)) == text
    except ValueError:
        return False


DEFAULT_PROJECT = "default"
"""Of keys and jobs that were made without one, and before there were projects."""

_PROJECT = re.compile(r"[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?")


def is_project(name: str) -> bool:
    """Whether a project can have this name: that of a DNS label (RFC 1123, section 2.1)."""
    return _PROJECT.fullmatch(name) is not None
