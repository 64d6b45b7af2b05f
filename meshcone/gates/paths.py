"""Which values of a report a gate can name, and finding them in it.

A name is a dotted path from the report's root (``solver.iterations``). Metrics and validity can be
named without the section they stand in (``point_to_surface.p95``, ``validity.watertight``), and
what an audit says without the mesh (``asset.budget.triangles``): they are then those of the
refined mesh or, where nothing was refined, of the source. ``warnings`` is
how many warnings there are, ``warnings.normals.opposed`` how many of one code.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from meshcone.auditing.records import AssetAudit
from meshcone.notices import COLORS, OF_PAIRS, WARNINGS, is_named, warnings_named
from meshcone.options import Mode
from meshcone.quality.deviation.records import DistanceInterval, ShareInterval
from meshcone.quality.records import Metrics
from meshcone.report.report import AnyReport, AuditReport, MeasureReport, Report

Kind = Literal["number", "interval", "truth", "word", "list"]
Value = float | bool | str | tuple[str, ...] | DistanceInterval | ShareInterval

NOT_TESTED = "not_tested"  # how a report states a value it did not determine, besides null
_KINDS: Mapping[type, Kind] = {bool: "truth", int: "number", float: "number", str: "word"}
_ABSENT = object()
Side = Literal["source", "reference", "refined"]
_ANY = "*"  # stands for every key of a section whose keys depend on the job
_REPORTS: Mapping[Mode, type[BaseModel]] = {
    "refine": Report,
    "measure": MeasureReport,
    "audit": AuditReport,
}
# Where metrics stand, and audits, those of the refined mesh first.
_JUDGED = ("quality.refined", "quality.input")
_JUDGED_ASSETS = ("asset.refined", "asset.source")


@dataclass(frozen=True)
class Known:
    """What a gate can know of a value before there is a report.

    Attributes:
        kind: what the value is; a list is one of words.
        choices: the words it can be or have; none where those can be any.
    """

    kind: Kind
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class Found:
    """A value of a report.

    Attributes:
        path: where it stands.
        value: None where the report leaves it open.
        not_examined: codes of warnings that a number of them should count and does not,
            because nobody looked: the number is the least it can be.
    """

    path: str
    value: Value | None
    not_examined: tuple[str, ...] = ()


@functools.cache
def known_values(mode: Mode) -> Mapping[str, Known]:
    """Every name a gate can use; ``*`` stands for any key."""
    named = {**dict(_leaves(_REPORTS[mode])), **dict(_leaves(AssetAudit, "asset."))}
    if mode != "audit":
        named |= dict(_leaves(Metrics))
    named |= dict.fromkeys(WARNINGS, Known("number"))
    # The verdict is not a value it could be about.
    return {name: value for name, value in named.items() if not name.startswith("gates.")}


def find(report: AnyReport, key: str) -> Found | None:
    """Find a value by its name; None where the report lacks the section it stands in."""
    if key in WARNINGS:
        count = len(warnings_named(report.warnings, key))
        return Found("warnings", count, tuple(_not_examined(report, key)))
    for path in _places(key):
        value = value_at(report, path)
        if value is not _ABSENT:
            return Found(path, None if value == NOT_TESTED else value)
    return None


def _not_examined(report: AnyReport, key: str) -> Iterator[str]:
    """Codes a gate's name is about that were not examined; of all, those this job looks for."""
    beside: frozenset[str] = frozenset()
    if key == "warnings" and isinstance(report, AuditReport):
        beside = COLORS if report.inputs.reference else OF_PAIRS
    for code in report.not_examined:
        if is_named(code, key) and code not in beside:
            yield code


def _places(key: str) -> list[str]:
    if is_metric(key):
        return [f"{section}.{key}" for section in _JUDGED]
    first, _, rest = key.partition(".")
    if first == "asset" and side_of(key) is None:
        return [f"{section}.{rest}" for section in _JUDGED_ASSETS]
    return [key]


def side_of(key: str) -> Side | None:
    """The mesh that a value of an audit is named with, if it is named with one."""
    second = key.split(".")[1:2]
    return next((side for side in get_args(Side) if [side] == second), None)


def in_reference(key: str) -> str:
    """The name of the same value of the reference, for a value of an audit."""
    first, _, rest = key.partition(".")
    side = side_of(key)
    return f"{first}.reference.{rest if side is None else rest.removeprefix(f'{side}.')}"


def value_at(report: BaseModel, path: str) -> Any:
    """The value at a full path; a mark of its own if it is absent, which None is not."""
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


def look_up(known: Mapping[str, Known], key: str) -> Known | None:
    """What is known of a name, if it is that of a value."""
    return known.get(key) or known.get(f"{key.rpartition('.')[0]}.{_ANY}")


def _leaves(model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, Known]]:
    for name, field in model.model_fields.items():
        yield from _leaves_of(field.annotation, prefix + (field.alias or name))


def _leaves_of(annotation: Any, path: str) -> Iterator[tuple[str, Known]]:
    """Names at and below a field; of lists, those of words alone have one."""
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from _leaves_of(get_args(annotation)[0], path)
    elif origin in (Union, UnionType):
        yield from _leaves_of_union(get_args(annotation), path)
    elif origin is Literal:
        yield path, Known("word", get_args(annotation))
    elif origin in (tuple, list):
        yield from _list_of(get_args(annotation)[0], path)
    elif origin is not None and issubclass(origin, Mapping):
        yield from _leaves_of(get_args(annotation)[1], f"{path}.{_ANY}")
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel):
        if issubclass(annotation, DistanceInterval | ShareInterval):
            yield path, Known("interval")
        yield from _leaves(annotation, f"{path}.")
    elif annotation in _KINDS:
        yield path, Known(_KINDS[annotation])


def _list_of(member: Any, path: str) -> Iterator[tuple[str, Known]]:
    if member is str:
        yield path, Known("list")
    elif get_origin(member) is Literal:
        yield path, Known("list", get_args(member))


def _leaves_of_union(members: tuple[Any, ...], path: str) -> Iterator[tuple[str, Known]]:
    """Names at and below a field of several types; a value of two kinds no bound would fit."""
    stated = [each for each in members if each not in (NoneType, Literal["not_tested"])]
    found: dict[str, list[Known]] = {}
    for member in stated:
        for name, known in _leaves_of(member, path):
            found.setdefault(name, []).append(known)
    for name, (first, *others) in found.items():
        if all(each.kind == first.kind for each in others):
            choices = [each.choices for each in (first, *others)]
            yield name, Known(first.kind, sum(choices, ()) if all(choices) else ())
