"""Finds what Python's JSON parser cannot say the place of."""

from __future__ import annotations

import json
import re

from meshcone.errors import InputError

_LEXEME = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"|[{}\[\]:]|[^\s{}\[\],:"]+', re.DOTALL)
# Only the start of a lexeme: the parser refuses these before it sees what follows.
_CONSTANT = re.compile(r"NaN|-?Infinity")
_MOST_DIGITS = 4300  # of a whole number, sys.int_info.default_max_str_digits
_TOO_LONG = re.compile(rf"-?(\d{{{_MOST_DIGITS + 1},}}+)(?!\.\d|[eE][+-]?\d)")


def json_fault(text: str) -> InputError:
    """Explain what is wrong with JSON that the parser refused without a place.

    Such are constants JSON does not know, whole numbers of thousands of digits, and a name an
    object has twice, which readers differ about (glTF 2.0, "JSON Encoding").
    """
    names: list[set[str]] = []
    previous, start = "", 0
    for match in _LEXEME.finditer(text):
        lexeme = match.group()
        if lexeme in "{[":
            names.append(set())
        elif lexeme in "}]":
            names.pop()
        elif lexeme == ":":
            name = json.loads(previous) if "\\" in previous else previous[1:-1]
            if name in names[-1]:
                return _fault(text, start, f"an object has two members '{name[:40]}'")
            names[-1].add(name)
        elif constant := _CONSTANT.match(lexeme):
            return _fault(text, match.start(), f"expected a number, found {constant[0]}")
        elif number := _TOO_LONG.match(lexeme):
            found = f"a number of at most {_MOST_DIGITS:,} digits, found {len(number[1]):,}"
            return _fault(text, match.start(), f"expected {found}")
        previous, start = lexeme, match.start()
    raise AssertionError("JSON that was refused has no fault")


def _fault(text: str, offset: int, message: str) -> InputError:
    line = text.count("\n", 0, offset) + 1
    column = offset - text.rfind("\n", 0, offset)
    return InputError(message, place=f"line {line}, column {column}")
