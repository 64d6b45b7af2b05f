"""Reading what no vertex depends on: what is malformed is told, and taken for absent."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from meshcone.assets.content.faults import Faults
from meshcone.assets.gltf.element import Element
from meshcone.errors import InputError

T = TypeVar("T")


class Lenient:
    """One object of a document, read as :class:`Element` reads it but for errors.

    Args:
        element: the object.
        faults: where malformed members are noted.

    Attributes:
        element: the object, to be read strictly.
    """

    def __init__(self, element: Element, faults: Faults) -> None:
        self.element = element
        self.faults = faults

    @property
    def pointer(self) -> str:
        """JSON pointer to it."""
        return self.element.pointer

    @property
    def name(self) -> str:
        """Its name; empty where it has none."""
        return self.text("name") or ""

    @property
    def extras(self) -> Any:
        """Data of the author's own; None where there are none."""
        return self.element.value.get("extras")

    def members(self) -> Iterator[str]:
        """The names of its members."""
        return iter(self.element.value)

    def extensions(self) -> tuple[str, ...]:
        """Names of the extensions it uses."""
        found = self.child("extensions")
        return tuple(sorted(found.members())) if found else ()

    def extension(self, name: str) -> Lenient | None:
        """What an extension says of it."""
        found = self.child("extensions")
        return found.child(name) if found else None

    def child(self, key: str) -> Lenient | None:
        """A member that is an object."""
        found = self._attempt(lambda: self.element.child(key))
        return Lenient(found, self.faults) if found else None

    def children(self, key: str) -> list[Lenient]:
        """A member that is an array of objects; anything else in it counts as an empty object."""
        items = self.element.value.get(key, [])
        if not isinstance(items, list):
            self.faults.note(self.element.place(key), "expected an array")
            return []
        found = []
        for number, item in enumerate(items):
            place = f"{self.element.place(key)}/{number}"
            if not isinstance(item, dict):
                self.faults.note(place, "expected an object")
            element = Element(item if isinstance(item, dict) else {}, place)
            found.append(Lenient(element, self.faults))
        return found

    def text(self, key: str) -> str | None:
        """A member that is a string."""
        return self._attempt(lambda: self.element.text(key))

    def texts(self, key: str) -> list[str]:
        """A member that is an array of strings; empty if absent."""
        return self._attempt(lambda: self.element.texts(key)) or []

    def flag(self, key: str) -> bool:
        """A member that is a boolean; False if absent."""
        return self._attempt(lambda: self.element.flag(key)) or False

    def integer(self, key: str) -> int | None:
        """A member that is a whole number, 0 or more."""
        return self._attempt(lambda: self.element.integer(key))

    def number(self, key: str, otherwise: float) -> float:
        """A member that is a finite number."""
        found = self._attempt(lambda: self.element.number(key))
        return otherwise if found is None else found

    def numbers(self, key: str, otherwise: tuple[float, ...]) -> tuple[float, ...]:
        """A member that is an array of as many finite numbers as ``otherwise`` has."""
        found = self._attempt(lambda: self.element.numbers(key, len(otherwise)))
        return otherwise if found is None else tuple(found)

    def reference(self, key: str, count: int, what: str) -> int | None:
        """A member that is an index into an array of ``count`` elements called ``what``."""
        return self._attempt(lambda: self.element.reference(key, count, what))

    def references(self, key: str, count: int, what: str) -> list[int]:
        """A member that is an array of such indices; empty if absent."""
        return self._attempt(lambda: self.element.references(key, count, what)) or []

    def attempt(self, read: Callable[[Element], T]) -> T | None:
        """Read the object in another way; None if that fails."""
        return self._attempt(lambda: read(self.element))

    def _attempt(self, read: Callable[[], T]) -> T | None:
        try:
            return read()
        except InputError as error:
            self.faults.note(error.place, error.message)
            return None
