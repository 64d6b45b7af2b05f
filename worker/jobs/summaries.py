"""The few numbers of a report that a list of jobs shows."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from meshcone.gates.records import GateCheck, Status
from meshcone.quality.records import Metrics
from meshcone.report.report import AnyReport, AuditReport

# Values of a report that mean something beside those of another job of the same kind.
_COMPARED = (
    "point_to_surface.mean",
    "point_to_surface.rms",
    "point_to_surface.p95",
    "point_to_surface.max",
    "chamfer",
    "hausdorff",
    "emd",
    "normal_consistency",
    "normal_deviation_deg",
    "curvature_error",
    "fscore",
    "aspect_ratio.median",
)


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True)


class WorstCheck(_Frozen):
    """The check of a job's gates that is nearest to its bound, or farthest past it."""

    key: str
    status: Status
    words: str


class JobSummary(_Frozen):
    """What a job's report says, in short."""

    outcome: str | None = Field(description="null where nothing was measured")
    radius: float | None = Field(
        description="of the reference, in model units; null where nothing was measured"
    )
    metrics: dict[str, float] = Field(
        description="of the refined mesh, or the input where nothing was refined, by name; empty "
        "where nothing was measured"
    )
    input: dict[str, float] = Field(description="the same of the input")
    worst: WorstCheck | None = Field(None, description="absent where there were no gates")
    seconds: float = Field(description="the engine took")

    @classmethod
    def of(cls, report: AnyReport) -> JobSummary:
        """Sum up a report."""
        worst = None if report.gates is None else _worst(report.gates.checks)
        seconds = report.timings.total
        if isinstance(report, AuditReport):
            return cls(
                outcome=None, radius=None, metrics={}, input={}, worst=worst, seconds=seconds
            )
        judged = report.quality.refined or report.quality.input
        return cls(
            outcome=report.outcome,
            radius=report.frame.radius,
            metrics=_compared(judged),
            input=_compared(report.quality.input),
            worst=worst,
            seconds=seconds,
        )


def _compared(metrics: Metrics) -> dict[str, float]:
    document = metrics.model_dump()
    values = {}
    for name in _COMPARED:
        value: Any = document
        for part in name.split("."):
            value = value[part]
        values[name] = float(value)
    return values


def _worst(checks: tuple[GateCheck, ...]) -> WorstCheck | None:
    if not checks:
        return None
    check = max(checks, key=_badness)
    return WorstCheck(key=check.key, status=check.status, words=check.words)


def _badness(check: GateCheck) -> tuple[int, bool, float]:
    """Failed checks first, errors before warnings, then those nearest to their bound."""
    order: dict[Status, int] = {"fail": 2, "not_tested": 1, "pass": 0}
    return order[check.status], check.severity == "error", _used_up(check)


def _used_up(check: GateCheck) -> float:
    """Share of the bound that the value takes; below 1 where it holds."""
    value, limit = check.value, check.limit
    if limit is None or isinstance(value, str | bool | tuple) or value is None:
        return 0.0
    part, whole = (limit, value) if check.bound.startswith("min") else (value, limit)
    return part / whole if whole > 0 else float(part > 0)
