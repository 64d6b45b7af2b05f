"""JSON to values and back, with what a double cannot hold."""

from __future__ import annotations

import json
import math
from typing import Any


class TooLarge(float):
    """A number of a file that is infinite here, with the text that it has there."""

    text: str

    def __new__(cls, text: str) -> TooLarge:
        """Keep the text."""
        number = super().__new__(cls, text)
        number.text = text
        return number

    def __deepcopy__(self, _known: dict[int, Any]) -> TooLarge:
        """A number does not change, so a copy needs none of its own."""
        return self


def parsed(text: str, **hooks: Any) -> Any:
    """The value of a JSON text. Takes the hooks of ``json.loads`` and raises what that raises."""
    return json.loads(text, parse_float=_number, **hooks)


def spelled(value: object) -> str:
    """The JSON text of a value that was parsed, or is made of such."""
    try:
        return json.dumps(value, allow_nan=False)
    except ValueError:  # which JSON has no word for
        return _spelled(value)


def _spelled(value: object) -> str:
    if isinstance(value, TooLarge):
        return value.text
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)}: {_spelled(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_spelled, value)) + "]"
    return json.dumps(value, allow_nan=False)


def _number(text: str) -> float:
    number = float(text)
    return number if math.isfinite(number) else TooLarge(text)
