"""Replaces values in JSON text and leaves every other character as it is.

Parsing and printing a document again would rewrite its numbers and its layout; a file
under version control should show the change that was made and no other.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping

Path = tuple[str | int, ...]

_LEXEME = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"|[{}\[\],:]|[^\s{}\[\],:"]+', re.DOTALL)


def replace_values(text: str, replacements: Mapping[Path, str]) -> str:
    """Put other JSON text in the place of existing values.

    Args:
        text: valid JSON.
        replacements: JSON text by path, for example ``("accessors", 3, "min")``; no path
            may lie within another.

    Raises:
        KeyError: a path does not exist.
    """
    pieces = []
    copied = 0
    missing = set(replacements)
    for path, start, end in _values(text):
        if path in missing:
            missing.discard(path)
            pieces += [text[copied:start], replacements[path]]
            copied = end
    if missing:
        raise KeyError(missing.pop())
    return "".join([*pieces, text[copied:]])


def _values(text: str) -> Iterator[tuple[Path, int, int]]:
    """Path, start and end of every value, in the order in which they end."""
    path: list[str | int] = []
    starts: list[int] = []
    in_object: list[bool] = []
    expect_key = False
    for match in _LEXEME.finditer(text):
        lexeme = match.group()
        if lexeme in "{[":
            starts.append(match.start())
            in_object.append(lexeme == "{")
            path.append("" if lexeme == "{" else 0)
            expect_key = lexeme == "{"
        elif lexeme in "}]":
            path.pop()
            in_object.pop()
            yield tuple(path), starts.pop(), match.end()
            expect_key = False
        elif lexeme == ",":
            expect_key = in_object[-1]
            if not expect_key:
                path[-1] += 1  # type: ignore[operator]
        elif lexeme == ":":
            expect_key = False
        elif expect_key:
            path[-1] = _unquote(lexeme)
        else:
            yield tuple(path), match.start(), match.end()


def _unquote(lexeme: str) -> str:
    key: str = json.loads(lexeme)
    return key
