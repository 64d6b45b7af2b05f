"""Texts: the mark before them, and strings that no file and no answer can hold.

JSON and file systems give halves of characters.
"""

from __future__ import annotations

BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""What some editors put before a text in UTF-8."""


def is_text(value: str) -> bool:
    """Whether a string can be written as UTF-8: it has no half of a surrogate pair."""
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return True


def as_text(value: str) -> str:
    """The string with each half of a surrogate pair written as its escape."""
    return value.encode(errors="backslashreplace").decode()
