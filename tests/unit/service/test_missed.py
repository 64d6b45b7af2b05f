"""What ``refine`` and ``submit`` print of gates and tolerances."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from meshcone.options import WITHIN_GATE
from service.cli import refine
from service.cli.missed import missed
from tests import shapes


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


def test_a_tolerance_is_not_said_to_be_missed_by_what_was_not_refined() -> None:
    within = {"reached": False, "asked": "1%", "attempts": 1, "places": [], "unit": "m"}

    found = missed(report("pass", within=within) | {"outcome": "misaligned"})

    assert found.lines == (
        "not within 1%, as source and reference do not fit: nothing was refined, and the input "
        "was written",
    )


def test_where_nothing_was_asked_for_nothing_is_missed() -> None:
    assert missed({"gates": None}) == missed({}) == missed(report("pass", row("pass")))


@pytest.mark.parametrize(("bound", "code"), [("1e-9", 1), ("1", 0)])
def test_refine_exits_with_1_where_a_gate_is_not_passed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], bound: str, code: int
) -> None:
    vertices, faces = shapes.sphere(1)
    rough, ball = tmp_path / "rough.obj", tmp_path / "ball.obj"
    rough.write_bytes(shapes.obj(shapes.noisy(vertices), faces))
    ball.write_bytes(shapes.obj(vertices, faces))
    gates = f'gates={{"point_to_surface.max": {{"max": {bound}}}}}'

    ended = refine.command(
        rough, ball, tmp_path / "out.obj", quiet=True, assignments=["effort=fast", gates]
    )

    assert ended == code
    assert ("FAILED" in capsys.readouterr().err) == (code == 1)
    assert (tmp_path / "out.obj").exists()
