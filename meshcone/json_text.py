"""JSON as it is sent to us: what a reader would drop in silence is refused."""

from __future__ import annotations

import json
from math import isinf
from typing import Any, NoReturn


def parse_json(text: str | bytes) -> Any:
    """The value that a text of JSON has.

    Of a name that an object has twice, RFC 8259 (section 4) leaves open which value holds; most
    readers keep the last. A gate that was written twice would lose one of its bounds, so the text
    is refused. JSON has no number that is not finite (section 6): Python would read some, and they
    pass comparisons that every other number fails.

    Raises:
        ValueError: the text is no JSON, an object in it has a name twice, or a number is not
            finite.
        RecursionError: it is nested too deeply.
    """
    return json.loads(
        text, object_pairs_hook=_named_once, parse_constant=_no_number, parse_float=_finite
    )


def part_decoder() -> json.JSONDecoder:
    """A decoder that refuses what :func:`parse_json` does, for readers of a text in parts."""
    return json.JSONDecoder(
        object_pairs_hook=_named_once, parse_constant=_no_number, parse_float=_finite
    )


def _no_number(text: str) -> NoReturn:
    raise NotFiniteError(f"{text} is no number that JSON has")


def _finite(text: str) -> float:
    value = float(text)
    if isinf(value):
        raise NotFiniteError(f"{text:.40} is too large for a number")
    return value


def _named_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members: dict[str, Any] = {}
    for name, value in pairs:
        if name in members:
            raise DuplicateNameError(name)
        members[name] = value
    return members


class NotFiniteError(ValueError):
    """A number is none, or larger than any that can be reckoned with."""


class DuplicateNameError(ValueError):
    """An object has a name twice."""

    def __init__(self, name: str) -> None:
        shown = ascii(name)[1:-1]
        super().__init__(f"'{shown:.80}' is there twice in one object; keep one of the two")
