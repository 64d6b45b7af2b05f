"""Finds what Python's JSON parser cannot say the place of."""

from __future__ import annotations

import json
import re

from meshcone.errors import InputError

_LEXEME = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"|[{}\[\]:]|[^\s{}\[\],:"]+', re.DOTALL)
_CONSTANTS = ("NaN", "Infinity", "-Infinity")
_MOST_DIGITS = 4300  # of a whole number, sys.int_info.default_max_str_digits


def json_fault(text: str) -> InputError:
    """Explain what is wrong with JSON of valid structure, at the first fault.

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
        elif lexeme in _CONSTANTS:
            return _fault(text, match.start(), f"expected a number, found {lexeme}")
        elif len(lexeme) > _MOST_DIGITS and lexeme.lstrip("-").isdigit():
            found = f"expected a number of at most {_MOST_DIGITS:,} digits, found {len(lexeme):,}"
            return _fault(text, match.start(), found)
        previous, start = lexeme, match.start()
    raise AssertionError("JSON that was refused has no fault")


def _fault(text: str, offset: int, message: str) -> InputError:
    line = text.count("\n", 0, offset) + 1
    column = offset - text.rfind("\n", 0, offset)
    return InputError(message, place=f"line {line}, column {column}")
