"""What is wrong with a document, and what its author may have meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping

from pydantic import ValidationError
from pydantic_core import ErrorDetails

_SHOWN = 40  # characters of a text


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ``; did you mean '…'?`` with the closest of the known names, or nothing."""
    close = close_to(name, known)
    return f"; did you mean '{close[0]}'?" if close else ""


def close_to(name: str, known: Iterable[str]) -> list[str]:
    """Return the closest of the known names, or none."""
    return difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)


def first_cause(error: ValidationError) -> ErrorDetails:
    """Return the one of the errors to tell.

    An unknown key goes before others: mistyped, it is why another is missing.
    """
    errors = error.errors()
    return next((each for each in errors if each["type"] == "extra_forbidden"), errors[0])


_OBJECT_TYPES = frozenset(
    {"dict_type", "model_type", "model_attributes_type", "dataclass_type", "mapping_type"}
)
_LIST_TYPES = frozenset({"list_type", "tuple_type", "set_type", "frozen_set_type"})


def in_words(error: ErrorDetails, an_object: str = "an object with names and values") -> str:
    """What is wrong with a value, for whoever wrote it: without the names of our own classes.

    Args:
        error: of a validation.
        an_object: what an object is called where the document comes from, with its article.
    """
    if error["type"] in _OBJECT_TYPES:
        return f"expected {an_object}, found {_kind(error['input'])}"
    if error["type"] in _LIST_TYPES:
        return f"expected a list, found {_kind(error['input'])}"
    return error["msg"].removeprefix("Value error, ").lower()


def _kind(value: object) -> str:
    if isinstance(value, Mapping):
        return "an object"
    if isinstance(value, str):
        return f"the text {value[:_SHOWN]!r}"
    if isinstance(value, list | tuple):
        return "a list"
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return f"the number {value:g}"
    return f"a value of type {type(value).__name__}"
