"""``Prefer: wait=N`` (RFC 7240, section 4.3): answer when the job has ended, if that is soon."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated

from fastapi import Header

LONGEST_WAIT = 30  # seconds; proxies give up on a silent answer after about a minute

_WAIT = re.compile(r'(?:^|,)\s*wait\s*=\s*"?(\d{1,9})"?\s*(?=[,;]|$)', re.IGNORECASE)

PreferHeader = Annotated[
    list[str] | None,
    Header(
        alias="Prefer",
        description=f"`wait=N`: seconds to wait for the job's end, at most {LONGEST_WAIT}",
    ),
]


def preferred_wait(headers: Sequence[str] | None) -> int | None:
    """Seconds a client would wait, as far as they are granted; None if it named none.

    What cannot be understood is ignored, as the RFC has it.
    """
    match = _WAIT.search(",".join(headers or ()))
    return None if match is None else min(int(match[1]), LONGEST_WAIT)
