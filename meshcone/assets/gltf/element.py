"""A JSON object together with where it stands, so that every complaint can say where."""

from __future__ import annotations

import math
from typing import Any

from meshcone.errors import InputError

# What every JSON reader can represent (RFC 8259, section 6), and no size or index exceeds.
_LARGEST_WHOLE = 2**53 - 1


class Element:
    """One object of a glTF document.

    Every reader returns None for an absent key and raises InputError, with a JSON pointer
    as its place, for a value of another type or out of range.
    """

    def __init__(self, value: dict[str, Any], pointer: str = "") -> None:
        self.value = value
        self.pointer = pointer

    def place(self, key: str | int) -> str:
        """JSON pointer (RFC 6901) to a member."""
        return f"{self.pointer}/{str(key).replace('~', '~0').replace('/', '~1')}"

    def error(self, key: str, message: str) -> InputError:
        """An error about a member."""
        return InputError(message, place=self.place(key))

    def child(self, key: str) -> Element | None:
        """A member that is an object."""
        if key not in self.value:
            return None
        if not isinstance(self.value[key], dict):
            raise self._unexpected(key, "an object")
        return Element(self.value[key], self.place(key))

    def children(self, key: str) -> list[Element]:
        """A member that is an array of objects; empty if absent."""
        items = self.value.get(key, [])
        if not isinstance(items, list):
            raise self._unexpected(key, "an array")
        found = []
        for number, item in enumerate(items):
            place = f"{self.place(key)}/{number}"
            if not isinstance(item, dict):
                raise InputError(f"expected an object, found {_kind(item)}", place=place)
            found.append(Element(item, place))
        return found

    def text(self, key: str) -> str | None:
        """A member that is a string."""
        value = self.value.get(key)
        if value is not None and not isinstance(value, str):
            raise self._unexpected(key, "a string")
        return value

    def texts(self, key: str) -> list[str]:
        """A member that is an array of strings; empty if absent."""
        items = self.value.get(key, [])
        if not isinstance(items, list) or not all(isinstance(item, str) for item in items):
            raise self._unexpected(key, "an array of strings")
        return items

    def flag(self, key: str) -> bool:
        """A member that is a boolean; False if absent."""
        value = self.value.get(key, False)
        if not isinstance(value, bool):
            raise self._unexpected(key, "a boolean")
        return value

    def integer(self, key: str, minimum: int = 0) -> int | None:
        """A member that is a whole number."""
        if key not in self.value:
            return None
        return _whole(self.value[key], minimum, self.place(key))

    def required_integer(self, key: str, minimum: int = 0) -> int:
        """A member that is a whole number and must be there."""
        value = self.integer(key, minimum)
        if value is None:
            raise self.error(key, f"'{key}' is missing")
        return value

    def reference(self, key: str, count: int, what: str) -> int | None:
        """A member that is an index into an array of ``count`` elements called ``what``."""
        if key not in self.value:
            return None
        return _index(self.value[key], count, what, self.place(key))

    def references(self, key: str, count: int, what: str) -> list[int]:
        """A member that is an array of such indices; empty if absent."""
        items = self.value.get(key, [])
        if not isinstance(items, list):
            raise self._unexpected(key, "an array")
        return [
            _index(item, count, what, f"{self.place(key)}/{number}")
            for number, item in enumerate(items)
        ]

    def number(self, key: str) -> float | None:
        """A member that is a finite number."""
        value = self.value.get(key)
        if value is not None and not _finite(value):
            raise self._unexpected(key, "a finite number")
        return None if value is None else float(value)

    def numbers(self, key: str, length: int) -> list[float] | None:
        """A member that is an array of ``length`` finite numbers."""
        if key not in self.value:
            return None
        items = self.value[key]
        if not isinstance(items, list) or len(items) != length:
            raise self._unexpected(key, f"an array of {length} finite numbers")
        for number, item in enumerate(items):
            if not _finite(item):
                place = f"{self.place(key)}/{number}"
                raise InputError(f"expected a finite number, found {_kind(item)}", place=place)
        return [float(item) for item in items]

    def _unexpected(self, key: str, expected: str) -> InputError:
        return self.error(key, f"expected {expected}, found {_kind(self.value[key])}")


def _whole(value: object, minimum: int, place: str) -> int:
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"expected a whole number, found {_kind(value)}", place=place)
    if value < minimum:
        raise InputError(f"expected at least {minimum}, found {_kind(value)}", place=place)
    if value > _LARGEST_WHOLE:
        raise InputError(f"expected at most {_LARGEST_WHOLE:,}, found {_kind(value)}", place=place)
    return value


def _index(value: object, count: int, what: str, place: str) -> int:
    index = _whole(value, 0, place)
    if index >= count:
        raise InputError(f"names {what} {_kind(index)}, but there are only {count}", place=place)
    return index


def _finite(item: object) -> bool:
    if isinstance(item, bool) or not isinstance(item, (int, float)):
        return False
    return abs(item) < 1e300 and math.isfinite(item)


def _kind(value: object) -> str:
    if isinstance(value, bool):
        return "a boolean"
    if isinstance(value, (int, float)):
        return f"{value}" if abs(value) < 1e15 else "a huge number"
    if isinstance(value, list):
        return f"an array of {len(value)}"
    if isinstance(value, str):
        return "a string"
    return "an object" if isinstance(value, dict) else "null"
