"""JSON as it is sent to us: what a reader would drop in silence is refused."""

from __future__ import annotations

import json
from typing import Any


def parse_json(text: str | bytes) -> Any:
    """The value that a text of JSON has.

    Of a name that an object has twice, RFC 8259 (section 4) leaves open which value holds; most
    readers keep the last. A gate that was written twice would lose one of its bounds, so the text
    is refused.

    Raises:
        ValueError: the text is no JSON, or an object in it has a name twice.
        RecursionError: it is nested too deeply.
    """
    return json.loads(text, object_pairs_hook=named_once)


def named_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The object that has these members, for readers that take a text in parts.

    Raises:
        DuplicateNameError: two have one name.
    """
    members: dict[str, Any] = {}
    for name, value in pairs:
        if name in members:
            raise DuplicateNameError(name)
        members[name] = value
    return members


class DuplicateNameError(ValueError):
    """An object has a name twice."""

    def __init__(self, name: str) -> None:
        shown = ascii(name)[1:-1]
        super().__init__(f"'{shown:.80}' is there twice in one object; keep one of the two")
