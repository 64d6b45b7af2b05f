"""Texts: the mark before them, what is one line, and strings that no file and no answer can hold.

JSON and file systems give halves of characters.
"""

from __future__ import annotations

import re
import unicodedata

BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""What some editors put before a text in UTF-8."""

# Controls, what ends a line or a paragraph, what turns the direction of all that follows, halves
# of characters, and the two that XML cannot write. Blanks of every width, joiners and soft hyphens
# are parts of names: people write them, and files are looked for by them.
_NOT_IN_A_LINE = re.compile(
    r"[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]"
)
_BLANKS = re.compile(r"[ \t\v\f]+")


def is_line(value: str) -> bool:
    """Whether a string is one line that can be shown as it is."""
    return _NOT_IN_A_LINE.search(value) is None


def as_line(value: str, instead: str = "") -> str:
    """The string without what no line can show, or with something else in its place."""
    return _NOT_IN_A_LINE.sub(instead, value)


def words_of(line: str) -> list[str]:
    """The words of a line as the text formats of meshes divide it.

    Blanks and tabs stand between them; wider and narrower spaces are parts of a name.
    """
    return [word for word in _BLANKS.split(line) if word]


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
