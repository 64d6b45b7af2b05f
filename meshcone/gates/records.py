"""The verdict of gates, as data."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from meshcone.gates.rules import Allowed, Bound, Severity

Status = Literal["pass", "fail", "not_tested"]


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class GateCheck(_Record):
    """One bound on one value."""

    key: str = Field(description="the value, as the gate names it")
    bound: Bound = Field(description="what kind of bound it is")
    allowed: Allowed = Field(description="the bound as it was set")
    value: Allowed | None = Field(
        description="as the report states it, or in model units for a bound in model units; "
        "null where it was not tested"
    )
    limit: float | None = Field(
        description="the number that the value was compared with, in its unit; null for words"
    )
    path: str | None = Field(description="where in this report the value stands")
    severity: Severity
    status: Status
    words: str = Field(description="the finding in one sentence")
    position: tuple[float, float, float] | None = Field(
        None, description="where a deviation is worst, in model units"
    )

    @property
    def rule(self) -> str:
        """A name for this check that is the same for every asset."""
        return f"{self.key}/{self.bound}"


class GateVerdict(_Record):
    """What the gates say of one asset."""

    verdict: Status = Field(
        description="fail if a check of severity error failed, else not_tested if one could "
        "not be made or there is none, else pass"
    )
    checks: tuple[GateCheck, ...]

    @staticmethod
    def of(checks: tuple[GateCheck, ...]) -> GateVerdict:
        """Sum up the checks; warnings do not count."""
        found = {check.status for check in checks if check.severity == "error"}
        verdict: Status = "pass"
        if not checks or "not_tested" in found:
            verdict = "not_tested"
        if "fail" in found:
            verdict = "fail"
        return GateVerdict(verdict=verdict, checks=checks)
