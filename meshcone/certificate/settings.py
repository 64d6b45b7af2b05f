"""Which options a refinement was made with, and whether its optimality then means anything.

With a proximal weight of a million the optimum of a round is where the round began, and
with a weight of a millionth the paper's program is blown up a million times after it was
solved: either way a point that was chosen freely is an optimum. Options allow such weights;
an optimum under them is none that anybody can count on without the rounds before it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from meshcone.certificate.checks import Check
from meshcone.options import Options

# How many times larger or smaller than its default a weight, a cap or a tolerance may be.
_LARGEST_FACTOR = 100.0
_LONGEST_VALUE = 60  # characters


def settings_check(options: Options, *, ranges: bool = True) -> Check:
    """List every option that differs from its default; those out of range in capitals.

    Args:
        options: the refinement's.
        ranges: whether it matters that an option is out of range: not where all rounds were run
            again, or none is claimed.
    """
    strange = dict(_out_of_range(options))
    shown = [
        f"{path.upper() if path in strange else path}={_short(value)}"
        for path, value in _different(options.model_dump(mode="json"), Options().model_dump())
    ]
    words = f"not the defaults: {', '.join(shown)}" if shown else "every option has its default"
    if not strange or not ranges:
        return Check("settings", True, words)
    bounds = "; ".join(f"{path} from {low:g} to {high:g}" for path, (low, high) in strange.items())
    told = "optimality says something only within a range"
    return Check("settings", False, f"{words}; {told}: {bounds}; --replay checks every round")


def _out_of_range(options: Options) -> Iterator[tuple[str, tuple[float, float]]]:
    """Name the numbers of the program in use that are far from their defaults, with the range.

    Zero turns a term off, where an option allows it, and is never out of range.
    """
    used = getattr(options, options.formulation)
    named = [(f"{options.formulation}.{name}", used, name) for name in type(used).model_fields]
    named.append(("solver.tolerance", options.solver, "tolerance"))
    for path, section, name in named:
        value, default = getattr(section, name), type(section).model_fields[name].default
        values, defaults = _numbers(value), _numbers(default)
        if not defaults:
            continue
        low, high = min(defaults) / _LARGEST_FACTOR, max(defaults) * _LARGEST_FACTOR
        if any(found != 0 and not low <= found <= high for found in values):
            yield path, (low, high)


def _numbers(value: object) -> list[float]:
    """The weights an option consists of; a count is none."""
    values = value if isinstance(value, tuple) else (value,)
    return [number for number in values if isinstance(number, float)]


def _different(value: Any, default: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and isinstance(default, dict) and default:
        for name, below in value.items():
            inner = f"{path}.{name}" if path else name
            yield from _different(below, default.get(name), inner)
    elif _short(value) != _short(default):
        yield path, value


def _short(value: object) -> str:
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=True)
    if len(text) <= _LONGEST_VALUE:
        return text
    return f"({len(value):,} entries)" if isinstance(value, list | dict) else f"{text[:40]}…"
