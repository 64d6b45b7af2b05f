"""Which values of a report a gate can name, and finding them in it.

A name is a dotted path from the report's root (``solver.iterations``). Metrics and validity can be
named without the section they stand in (``point_to_surface.p95``, ``validity.watertight``): they
are then those of the refined mesh or, where nothing was refined, of the source. ``warnings`` is
how many warnings there are, ``warnings.normals.opposed`` how many of one code.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from meshcone.errors import InputError
from meshcone.gates.rules import Allowed, GateRule, GateTable
from meshcone.gates.units import is_distance
from meshcone.notices import WARNINGS, warnings_named
from meshcone.quality.deviation.records import ProvenInterval
from meshcone.quality.records import Metrics
from meshcone.report.report import MeasureReport, Report
from meshcone.suggestions import did_you_mean

Kind = Literal["number", "interval", "truth", "word"]
Mode = Literal["refine", "measure"]

NOT_TESTED = "not_tested"  # how a report states a value it did not determine, besides null
_KINDS: Mapping[type, Kind] = {bool: "truth", int: "number", float: "number", str: "word"}
AnyReport = Report | MeasureReport
_ABSENT = object()
_ANY = "*"  # stands for every key of a section whose keys depend on the job
_REPORTS: Mapping[Mode, type[BaseModel]] = {"refine": Report, "measure": MeasureReport}
# Where metrics stand, the refined mesh's first.
_JUDGED = ("quality.refined", "quality.input")


@dataclass(frozen=True)
class Known:
    """What a gate can know of a value before there is a report.

    Attributes:
        kind: what the value is.
        choices: the words it can be; none where it can be any.
    """

    kind: Kind
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class Found:
    """A value of a report.

    Attributes:
        path: where it stands.
        value: a number, interval, truth value or word; None where the report leaves it open.
    """

    path: str
    value: float | bool | str | ProvenInterval | None


def require_known(gates: GateTable, mode: Mode) -> None:
    """Check that the gates name values a report of this mode has, with bounds that fit them.

    Raises:
        InputError: naming the first that does not.
    """
    known = known_values(mode)
    for key, rule in gates.items():
        value = _look_up(known, key)
        if value is None:
            _require_no_value(known, key, rule)
            raise InputError(_unknown(key, mode))
        for bound, allowed in rule.bounds().items():
            wanted = _wanted(key, value.kind, bound, mode)
            if wanted is not None:
                raise InputError(f"gate '{key}': '{bound}' is for {wanted}")
            _require_possible(key, value, allowed)


@functools.cache
def known_values(mode: Mode) -> Mapping[str, Known]:
    """Every name a gate can use; ``*`` stands for any key."""
    named = {**dict(_leaves(_REPORTS[mode])), **dict(_leaves(Metrics))}
    named |= dict.fromkeys(WARNINGS, Known("number"))
    # The verdict is not a value it could be about.
    return {name: value for name, value in named.items() if not name.startswith("gates.")}


def find(report: AnyReport, key: str) -> Found | None:
    """Find a value by its name; None where the report lacks the section it stands in."""
    if key in WARNINGS:
        return Found("warnings", len(warnings_named(report.warnings, key)))
    paths = [f"{section}.{key}" for section in _JUDGED] if is_metric(key) else [key]
    for path in paths:
        value = value_at(report, path)
        if value is not _ABSENT:
            return Found(path, None if value == NOT_TESTED else value)
    return None


def value_at(report: BaseModel, path: str) -> Any:
    """The value at a full path; the absence of it is no value of its own."""
    *sections, leaf = path.split(".")
    section: Any = report
    for name in sections:
        section = _member(section, name)
    return _member(section, leaf)


def _member(section: Any, name: str) -> Any:
    if isinstance(section, BaseModel):
        names = {field.alias or own: own for own, field in type(section).model_fields.items()}
        return getattr(section, names[name]) if name in names else _ABSENT
    return section.get(name, _ABSENT) if isinstance(section, Mapping) else _ABSENT


def is_metric(key: str) -> bool:
    """Whether a name is that of a metric, which input and floor have as well."""
    return key.partition(".")[0] in Metrics.model_fields


def _look_up(known: Mapping[str, Known], key: str) -> Known | None:
    return known.get(key) or known.get(f"{key.rpartition('.')[0]}.{_ANY}")


def _require_no_value(known: Mapping[str, Known], key: str, rule: GateRule) -> None:
    """Recognise ``point_to_surface.max = 0.1``, whose last part was read as a bound."""
    for bound in rule.bounds():
        if _look_up(known, f"{key}.{bound}"):
            raise InputError(
                f"gate '{key}.{bound}' must be a table of bounds, such as {{ max = 0.01 }}"
            )


def _unknown(key: str, mode: Mode) -> str:
    if mode == "measure" and _look_up(known_values("refine"), key):
        return f"gate '{key}': a report has this only where the mesh was refined"
    return f"unknown gate '{key}'{did_you_mean(key, known_values(mode))}"


def _require_possible(key: str, value: Known, allowed: Allowed) -> None:
    words = allowed if isinstance(allowed, tuple) else (allowed,)
    for word in words:
        if value.kind == "truth" and not isinstance(word, bool):
            raise InputError(f"gate '{key}' is about a yes-or-no value: true or false")
        possible = word in value.choices if value.choices else isinstance(word, str)
        if value.kind == "word" and not possible:
            hint = did_you_mean(str(word), value.choices)
            raise InputError(f"gate '{key}': the value is never {json.dumps(word)}{hint}")


def _wanted(key: str, kind: Kind, bound: str, mode: Mode) -> str | None:
    """Say what a bound is for, if not for this value."""
    numeric = kind in ("number", "interval")
    if (bound == "equals" and numeric) or (bound == "one_of" and kind != "word"):
        return "words and yes-or-no values" if bound == "equals" else "words"
    if bound not in ("equals", "one_of") and not numeric:
        return "numbers"
    if bound.endswith("_model") and not is_distance(key):
        return "distances"
    if "_ratio_" in bound and not is_metric(key):
        return "metrics"
    if bound.endswith("_to_input") and mode == "measure":
        return "refined meshes"
    return None


def _leaves(model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, Known]]:
    for name, field in model.model_fields.items():
        yield from _leaves_of(field.annotation, prefix + (field.alias or name))


def _leaves_of(annotation: Any, path: str) -> Iterator[tuple[str, Known]]:
    """Names at and below a field; lists have none: their elements have no names."""
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from _leaves_of(get_args(annotation)[0], path)
    elif origin in (Union, UnionType):
        yield from _leaves_of_union(get_args(annotation), path)
    elif origin is Literal:
        yield path, Known("word", get_args(annotation))
    elif origin is not None and issubclass(origin, Mapping):
        yield from _leaves_of(get_args(annotation)[1], f"{path}.{_ANY}")
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel):
        if issubclass(annotation, ProvenInterval):
            yield path, Known("interval")
        yield from _leaves(annotation, f"{path}.")
    elif annotation in _KINDS:
        yield path, Known(_KINDS[annotation])


def _leaves_of_union(members: tuple[Any, ...], path: str) -> Iterator[tuple[str, Known]]:
    stated = [each for each in members if each not in (NoneType, Literal["not_tested"])]
    for member in stated:
        yield from _leaves_of(member, path)
