"""Runs of gates with every way a check can end."""

from __future__ import annotations

from meshcone.gates.records import GateCheck, GateVerdict, Status
from meshcone.gates.results import AssetError, AssetResult, GateRun
from meshcone.gates.rules import Severity
from meshcone.notices import Code, WarningRecord, warning


def check(status: Status, severity: Severity = "error", key: str = "emd") -> GateCheck:
    """A check that ended so."""
    tested = status != "not_tested"
    return GateCheck(
        key=key,
        bound="max",
        allowed=0.5,
        value=0.7 if tested else None,
        limit=0.5 if tested else None,
        path=f"quality.input.{key}",
        severity=severity,
        status=status,
        words=f"{key} {status} <&>",
        position=(1.0, 2.0, 3.0) if status == "fail" else None,
    )


def asset(name: str, *checks: GateCheck, source: str | None = None) -> AssetResult:
    """An asset with a verdict."""
    return AssetResult(
        name=name,
        source=source or name,
        reference="reference.obj",
        seconds=0.25,
        verdict=GateVerdict.of(checks),
    )


OPPOSED = warning(Code.NORMALS_OPPOSED, "pair", "Most normals <oppose> each other.")


def warned(name: str, *warnings: WarningRecord) -> AssetResult:
    """An asset that passes and whose report warns."""
    return asset(name, check("pass")).model_copy(update={"warnings": warnings})


def broken(name: str, kind: str, message: str) -> AssetResult:
    """An asset without a verdict."""
    error = AssetError.model_validate({"kind": kind, "message": message})
    return AssetResult(name=name, source=name, reference="reference.obj", seconds=0.5, error=error)


MIXED = GateRun.of(
    [
        asset("good.obj", check("pass"), check("pass", "warning", "chamfer")),
        asset("bad one.obj", check("fail"), check("pass", "warning", "chamfer")),
        asset("warned.obj", check("pass"), check("fail", "warning", "chamfer")),
        asset("open.obj", check("not_tested"), check("not_tested", "warning", "chamfer")),
        broken("cut\x0b.glb", "input", "cut.glb: the file ends too early"),
        broken("huge.obj", "internal", "the process that worked on it was ended by SIGKILL"),
    ]
)
