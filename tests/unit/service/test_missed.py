"""What ``refine`` and ``submit`` print of gates and tolerances."""

from __future__ import annotations

from typing import Any

from meshcone.options import WITHIN_GATE
from service.cli.missed import missed


def row(status: str, key: str = "emd", severity: str = "error") -> dict[str, Any]:
    return {"status": status, "key": key, "severity": severity, "words": f"{key} is so"}


def report(verdict: str, *checks: dict[str, Any], within: Any = None) -> dict[str, Any]:
    return {"gates": {"verdict": verdict, "checks": checks}, "within": within}


def test_a_gate_that_is_not_passed_is_told_and_fails() -> None:
    found = missed(report("fail", row("pass", "chamfer"), row("fail"), row("not_tested", "psnr")))

    assert found.failed
    assert [line.split()[-3] for line in found.lines] == ["emd", "psnr"]
    assert found.lines[0].startswith("FAILED  ")


def test_a_gate_that_warns_is_told_and_fails_nothing() -> None:
    found = missed(report("pass", row("fail", severity="warning")))

    assert (len(found.lines), found.failed) == (1, False)


def test_the_gate_of_a_tolerance_is_told_once_as_its_reason() -> None:
    within = {"reached": False, "asked": "1mm", "attempts": 1, "places": [], "unit": "m"}

    found = missed(report("fail", row("fail", WITHIN_GATE), row("fail"), within=within))

    assert found.failed
    assert [line.split()[0] for line in found.lines] == ["not", "reason", "FAILED"]


def test_where_nothing_was_asked_for_nothing_is_missed() -> None:
    assert missed({"gates": None}) == missed({}) == missed(report("pass", row("pass")))
