"""Holding a report against gates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TypeVar

from meshcone.gates.keep import keep_gates
from meshcone.gates.paths import Found, Value, find, in_reference, value_at
from meshcone.gates.records import GateCheck, GateVerdict, Status
from meshcone.gates.rules import Allowed, Bound, GateRule, GateTable
from meshcone.gates.units import Unit, formats_for, is_distance, unit_for
from meshcone.gates.words import name_of, number, point, stated
from meshcone.notices import warnings_named
from meshcone.quality.deviation.records import DistanceInterval, ShareInterval
from meshcone.report.report import AnyReport, AuditReport, MeasureReport, Report

SameReport = TypeVar("SameReport", Report, MeasureReport, AuditReport)

# Below this, relative to the radius, a distance is the rounding of the files' own numbers.
ROUNDING = 1e-9
_DEVIATION = "point_to_surface"
_PROVEN = "deviation"
_SHOWN = 5  # words of a list
_RULES = {"all_match": "must match", "none_match": "must not match"}


def judged(report: SameReport) -> SameReport:
    """Return the report with the verdict of the gates its options ask for, if they do."""
    gates = {**keep_gates(report.options.keep), **report.options.gates}
    return report.model_copy(update={"gates": judge(report, gates)}) if gates else report


def judge(report: AnyReport, gates: GateTable) -> GateVerdict:
    """Check every bound against a report.

    A value the report leaves open is ``not_tested``, which is no pass. A bound itself is
    allowed. A distance smaller than rounding counts as 0, so that a multiple of a floor of 0
    allows 0 and nothing else; the ends of a proven interval are compared as they are.

    Args:
        report: of a refinement, a measurement or an audit.
        gates: by the name of a value; see :func:`meshcone.gates.fitting.require_known`.
    """
    checks = (
        _check(report, key, rule, bound, allowed)
        for key, rule in gates.items()
        for bound, allowed in rule.bounds().items()
    )
    return GateVerdict.of(tuple(checks))


def _check(
    report: AnyReport, key: str, rule: GateRule, bound: Bound, allowed: Allowed
) -> GateCheck:
    found = find(report, key)
    if found is None or found.value is None:
        finding = _Finding(
            None, None, "not_tested", f"{name_of(key)}: {_why_open(report, key, found)}"
        )
    elif isinstance(found.value, bool | str | tuple):
        finding = _compare_words(key, found.value, bound, allowed)
    else:
        assert isinstance(allowed, float)  # noqa: S101 - require_known has seen to it
        comparison = _Comparison(report, key, rule, bound, allowed)
        if isinstance(found.value, DistanceInterval | ShareInterval):
            finding = comparison.with_interval(found.value)
        else:
            finding = comparison.with_value(found.value)
            if found.not_examined:
                finding = _with_more(finding, found, key, bound)
    return GateCheck(
        key=key,
        bound=bound,
        allowed=allowed,
        value=finding.value,
        limit=finding.limit,
        path=found.path if found else None,
        severity=rule.severity,
        status=finding.status,
        words=finding.words,
        position=finding.position,
    )


@dataclass(frozen=True)
class _Finding:
    value: Value | None
    limit: float | None
    status: Status
    words: str
    position: tuple[float, float, float] | None = None


def _why_open(report: AnyReport, key: str, found: Found | None) -> str:
    if found is None and report.inputs.reference is None:
        return "not tested, because there is no reference to compare with"
    if found is None:
        return "not tested, because the report has no such section"
    if key.startswith("changes."):
        one = "an image" if key.endswith(".images") else "an image or a material library"
        return f"not tested, because {one} that both files name was not sent"
    return "not tested"


def _with_more(finding: _Finding, found: Found, key: str, bound: Bound) -> _Finding:
    """What stands however many more warnings there are than were looked for."""
    if finding.status == ("fail" if bound.startswith("max") else "pass"):
        return finding
    why = f"not tested, because this run did not look for {_some(found.not_examined)}"
    return _Finding(None, None, "not_tested", f"{name_of(key)}: {why}")


def _compare_words(
    key: str, value: bool | str | tuple[str, ...], bound: Bound, allowed: Allowed
) -> _Finding:
    rule = _RULES.get(bound, "must be")
    listed = allowed if isinstance(allowed, tuple) else (allowed,)
    words = value if isinstance(value, tuple) else (value,)
    if bound == "equals":
        wrong = [] if Counter(map(str, words)) == Counter(map(str, listed)) else list(words)
    elif bound == "one_of":
        wrong = [word for word in words if word not in listed]
    else:
        wrong = [word for word in words if _matches(str(word), listed) != (bound == "all_match")]
    fits = not wrong and (bound != "equals" or len(words) == len(listed))
    shown = stated(value) if isinstance(value, bool | str) else _some(words if fits else wrong)
    sentence = f"{name_of(key)}: {shown}" + ("" if fits else f", {rule} {stated(allowed)}")
    return _Finding(value, None, "pass" if fits else "fail", sentence)


def _as_number(value: object) -> float | None:
    """A value that a ratio can be to; None where the report leaves it open or has none."""
    if isinstance(value, bool) or not isinstance(value, float | int):
        return None
    return float(value)


def _some(words: Sequence[object]) -> str:
    """Write the first words of a list, and how many there are."""
    if not words:
        return "none"
    more = f" and {len(words) - _SHOWN:,} more" if len(words) > _SHOWN else ""
    return ", ".join(f"'{word}'" for word in words[:_SHOWN]) + more


def _matches(word: str, globs: tuple[object, ...]) -> bool:
    return any(fnmatchcase(word, str(glob)) for glob in globs)


@dataclass(frozen=True)
class _Comparison:
    """One numeric bound on one value."""

    report: AnyReport
    key: str
    rule: GateRule
    bound: Bound
    allowed: float

    def with_value(self, value: float) -> _Finding:
        """Compare the value the report states."""
        base = self._base()
        if self._is_ratio and base is None:
            whose = self.bound.rpartition("_")[2]
            why = f"not tested, because the {whose} has no such value"
            return _Finding(value, None, "not_tested", f"{name_of(self.key)}: {why}")
        limit = self.allowed if base is None else self.allowed * base
        if self.bound.endswith("_model"):
            value *= (self._radius if is_distance(self.key) else 1.0) / self._unit.length
        least, most = (value, limit) if self._is_upper else (limit, value)
        within = least <= most or max(abs(value), abs(limit)) <= self._rounding
        words = "".join(self._words(value, limit, base, within=within))
        position = None if within else self._worst_position()
        return _Finding(value, limit, "pass" if within else "fail", words, position)

    def with_interval(self, found: DistanceInterval | ShareInterval) -> _Finding:
        """Decide by the end that proves it; between the ends nothing is decided.

        Rounding is not forgiven: the ends already hold in spite of it.
        """
        lower, upper = found.lower, found.upper
        at = found.at if isinstance(found, DistanceInterval) else None
        if self.bound.endswith("_model") and isinstance(found, DistanceInterval):
            lower, upper = self._ends_in_unit(found)
        if self._is_upper:
            within, beyond = upper <= self.allowed, lower > self.allowed
        else:
            within, beyond = lower >= self.allowed, upper < self.allowed
        value = upper if within == self._is_upper else lower
        status: Status = "pass" if within else "fail" if beyond else "not_tested"
        position = at if status == "fail" else None
        words = self._interval_words(lower, upper, value, status, position)
        return _Finding(value, self.allowed, status, words, position)

    def _interval_words(
        self,
        lower: float,
        upper: float,
        value: float,
        status: Status,
        position: tuple[float, float, float] | None,
    ) -> str:
        """Say where a value lies, and what is allowed of it.

        Args:
            lower: one end of the interval.
            upper: the other end.
            value: the one that decides.
            status: what it decides.
            position: where a value that is too large was found.
        """
        if status == "not_tested":
            found = f"between {number(lower, upper)} and {self._with_unit(upper, lower)}"
        else:
            end = "at most" if value == upper else "at least"
            found = f"{end} {self._with_unit(value, self.allowed)}"
        if self._is_upper and position is not None:
            found += f" at {point(position)}"
        limit = self._with_unit(self.allowed, value)
        wanted = f"allowed {limit}" if self._is_upper else f"at least {limit} required"
        open_ = ": not decided within `deviation.pieces`" if status == "not_tested" else ""
        return f"{name_of(self.key)} {found}, {wanted}{open_}"

    def _ends_in_unit(self, found: DistanceInterval) -> tuple[float, float]:
        """Both ends in the unit of the bound, rounded outwards."""
        unit = self._unit
        return unit.at_least(found.lower_model), unit.at_most(found.upper_model)

    @property
    def _unit(self) -> Unit:
        """What bounds in model units are in: of a size, as the file is that has it."""
        sides = self.report.inputs
        reference = None if sides.reference is None else sides.reference.format
        scaled = self.report.options.align == "similarity"
        formats = formats_for(self.key, sides.source.format, reference, scaled=scaled)
        return unit_for(self.rule.unit, *formats)

    @property
    def _radius(self) -> float:
        """Of the reference; asked for where a value is a distance, which no audit has."""
        assert not isinstance(self.report, AuditReport)  # noqa: S101
        return self.report.frame.radius

    @property
    def _rounding(self) -> float:
        """What counts as 0, in the unit of the comparison: of distances that are not proven."""
        if self.key.partition(".")[0] == _PROVEN or not is_distance(self.key):
            return 0.0
        in_model_units = self.bound.endswith("_model")
        return ROUNDING * self._radius / self._unit.length if in_model_units else ROUNDING

    @property
    def _is_upper(self) -> bool:
        return self.bound.startswith("max")

    @property
    def _is_ratio(self) -> bool:
        return "_ratio_" in self.bound

    def _base(self) -> float | None:
        """What a ratio is to: the same of the input, the floor or the reference."""
        if self.bound.endswith("_to_reference"):
            found = find(self.report, in_reference(self.key))
            return _as_number(None if found is None else found.value)
        for section in ("input", "floor"):
            if self.bound.endswith(f"_to_{section}"):
                return _as_number(value_at(self.report, f"quality.{section}.{self.key}"))
        return None

    def _words(
        self, value: float, limit: float, base: float | None, *, within: bool
    ) -> Iterator[str]:
        yield f"{name_of(self.key)} {self._with_unit(value, limit)}"
        if base is not None:
            yield f", {self._whose()} {number(base)}"
        if not within and (worst := self._worst_position()) is not None:
            yield f"{'' if self.key.endswith('.max') else ', worst'} near {point(worst)}"
        yield ", allowed " if self._is_upper else ", at least "
        if base is None:
            yield self._with_unit(limit, value)
        else:
            yield f"{number(self.allowed)} times that"
        if not self._is_upper:
            yield " required"
        if not within and (told := self._told()):
            yield f": {'; '.join(told)}"

    def _told(self) -> list[str]:
        """What was counted, where it is warnings or changes: the first of it, in words."""
        changes = self.report.changes
        rows = () if changes is None else changes.rows
        named = [each.words for each in rows if self.key == f"changes.{each.kind}.{each.what}"]
        if len(named) > _SHOWN:
            named[_SHOWN:] = [f"and {len(named) - _SHOWN:,} more"]
        return named or [str(each) for each in warnings_named(self.report.warnings, self.key)[:1]]

    def _whose(self) -> str:
        whose = {"input": "the input's", "floor": "the floor", "reference": "the reference's"}
        return whose[self.bound.rpartition("_")[2]]

    def _with_unit(self, value: float, beside: float) -> str:
        unit = self._unit
        if self.bound.endswith("_model"):
            return f"{number(value, beside)} {unit.name}"
        if self.bound in ("max", "min") and is_distance(self.key):
            model = number(value * self._radius / unit.length)
            return f"{number(value, beside)} of the radius ({model} {unit.name})"
        return number(value, beside)

    def _worst_position(self) -> tuple[float, float, float] | None:
        if isinstance(self.report, AuditReport):
            return None
        worst = self.report.quality.worst_points
        is_deviation = self.key.partition(".")[0] == _DEVIATION
        return worst[0].position if is_deviation and worst else None
