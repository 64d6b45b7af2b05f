"""What is said of arguments that are of no use to the functions of the library."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any

from meshcone.errors import ArgumentError, InputError
from meshcone.library.results import Audited, Measured, Refined, Verdict


def kind_of(value: object) -> str:
    """What messages call a value that is something else than was expected."""
    return f"a value of type {type(value).__name__}"


def require_text(value: object, name: str) -> None:
    """Refuse what is neither text nor left out.

    Raises:
        ArgumentError: it is something else.
    """
    if value is not None and not isinstance(value, str):
        raise ArgumentError(f"'{name}' must be text, found {kind_of(value)}")


def require_processes(count: object) -> None:
    """Refuse what is no number of processes.

    Raises:
        InputError: it is none, or less than one.
    """
    if isinstance(count, bool) or not isinstance(count, Integral):
        raise ArgumentError(f"'processes' must be a whole number, found {kind_of(count)}")
    if count < 1:
        raise InputError(f"'processes' must be 1 or more, found {count}")


def require_accepted(accepted: Any, percentile: object) -> None:
    """Refuse what no gates can be proposed from.

    Raises:
        ArgumentError: there are no results by name, or the percentile is no number.
    """
    if not isinstance(accepted, Mapping):
        raise ArgumentError(f"expected a mapping of names to results, found {kind_of(accepted)}")
    for name, result in accepted.items():
        if not isinstance(result, Measured | Audited | Refined | Verdict):
            raise ArgumentError(
                "expected what meshcone.measure or meshcone.audit returned, found "
                f"{kind_of(result)}",
                file=str(name),
            )
    if isinstance(percentile, bool) or not isinstance(percentile, Real):
        raise ArgumentError(f"'percentile' must be a number, found {kind_of(percentile)}")
