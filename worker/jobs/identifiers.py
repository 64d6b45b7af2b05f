"""Names of jobs, and of the projects they belong to."""

from __future__ import annotations

import re
import secrets
import time
import uuid


def new_job_id() -> str:
    """A UUID of version 7 (RFC 9562, section 5.7): unguessable, and sorting by creation time."""
    milliseconds = time.time_ns() // 1_000_000
    bits = (milliseconds & (2**48 - 1)) << 80 | secrets.randbits(80)
    bits = bits & ~(0xF << 76) | 0x7 << 76  # version
    bits = bits & ~(0x3 << 62) | 0x2 << 62  # variant
    return str(uuid.UUID(int=bits))


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
