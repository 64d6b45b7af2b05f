"""Comments of text formats, and the words that look like ones and are none."""

from __future__ import annotations

import re

# What Microsoft's C library printed for what is no number, ``1.#IND`` and its like. Where it was
# to print a few digits, the letters are rounded too: ``1.#J``.
NO_NUMBER = re.compile(rb"[+-]?1\.#[a-z]+\d*", re.I)
_INSIDE_A_WORD = rb"(?:(?<=\A1\.)|(?<=\s1\.)|(?<=\A[+-]1\.)|(?<=\s[+-]1\.))#[a-z]"
_COMMENT = re.compile(rb"(?!" + _INSIDE_A_WORD + rb")#", re.I)


def uncommented(line: bytes) -> bytes:
    """A line up to its comment, which ``#`` starts unless it stands in ``1.#IND`` and its like."""
    found = _COMMENT.search(line) if b"#" in line else None
    return line if found is None else line[: found.start()]
