"""What is wrong with a document, and what who wrote it may have meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from pydantic import ValidationError
from pydantic_core import ErrorDetails


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ``; did you mean '…'?`` with the closest of the known names, or nothing."""
    close = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"; did you mean '{close[0]}'?" if close else ""


def first_cause(error: ValidationError) -> ErrorDetails:
    """Return the one of the errors to tell.

    An unknown key goes before others: mistyped, it is why another is missing.
    """
    errors = error.errors()
    return next((each for each in errors if each["type"] == "extra_forbidden"), errors[0])
