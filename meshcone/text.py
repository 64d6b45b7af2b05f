"""Texts: the mark before them, and strings that no file and no answer can hold.

JSON and file systems give halves of characters.
"""

from __future__ import annotations

import unicodedata

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


def printable(value: str) -> str:
    """The string as a part of one line for a terminal.

    Line ends, what steers a terminal and what turns the direction of a text are written as their
    escapes. Halves of surrogate pairs stay: they stand for the bytes of names that are no UTF-8.
    """
    return "".join(each if _is_shown(each) else _escape(each) for each in value)


def _is_shown(character: str) -> bool:
    # Python takes every space but one for unprintable.
    return character.isprintable() or unicodedata.category(character) in ("Zs", "Cs")


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")
