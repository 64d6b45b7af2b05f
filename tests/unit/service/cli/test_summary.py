from __future__ import annotations

import io
from typing import Any

import pytest
from rich.console import Console

from service.cli.metrics_table import metrics_table
from service.cli.summary import summary_lines


def report(outcome: str = "improved") -> dict[str, Any]:
    def metrics(mean: float, emd: float) -> dict[str, Any]:
        return {"point_to_surface": {"mean": mean}, "emd": emd}

    return {
        "outcome": outcome,
        "quality": {
            "input": metrics(0.01, 0.0),
            "refined": metrics(0.00025, 0.02),
            "floor": metrics(3e-17, 0.02),
            "conventions": {"samples": 5000},
        },
        "solver": {
            "candidate": "pulling",
            "confirmed": True,
            "rounds": [
                {"method": "relaxation", "info": None},
                {"method": "relaxation", "info": None},
                {
                    "method": "multipliers",
                    "info": {
                        "status": "solved",
                        "iterations": 0,
                        "linear_solver": "sparse-indirect-scs",
                        "setup_seconds": 0.1,
                        "solve_seconds": 0.05,
                    },
                },
            ],
        },
        "certificate": {
            "holds": True,
            "tolerance": 1e-5,
            "cones": {"edge_cap": 14000, "pin": 832},
            "active": {"edge_cap": 7, "pin": 832},
            "optimum": {"primal": 0.0, "dual": 1e-7, "gap": 3e-9, "complementarity": 0.0},
        },
        "timings": {"solve": 1.234, "total": 2.0, "metrics": {"emd": 0.1}},
    }


def rendered(table: object) -> list[str]:
    text = io.StringIO()
    Console(file=text, width=80).print(table)
    return text.getvalue().splitlines()


def test_each_metric_has_its_row_under_the_name_gates_use() -> None:
    (row,) = [line for line in rendered(metrics_table(report())) if "point_to_surface.mean" in line]
    assert row.split() == ["point_to_surface.mean", "0.01", "0.00025", "0", "0.025"]


def test_no_ratio_to_nothing() -> None:
    (row,) = [line for line in rendered(metrics_table(report())) if "emd" in line]
    assert row.split() == ["emd", "0", "0.02", "0.02", "-"]


def line_of(name: str, of: dict[str, Any]) -> str:
    (line,) = [line for line in summary_lines(of) if line.startswith(name)]
    return line


def test_summary_counts_cones_of_every_kind() -> None:
    assert "14,000 edge_cap, 832 pin; active 7 edge_cap, 832 pin" in line_of("cones", report())


def test_summary_says_what_solved_the_rounds() -> None:
    line = line_of("rounds", report())
    assert "3 with the setting 'pulling': 2 by relaxation, 1 by multipliers" in line


def test_summary_says_what_was_proved() -> None:
    failing = report()
    failing["certificate"]["holds"] = False

    assert "holds: residuals primal 0.0e+00, dual 1.0e-07" in line_of("certificate", report())
    assert "does not hold" in line_of("certificate", failing)


def test_summary_says_what_scs_thinks_of_it() -> None:
    unsure, unasked = report(), report()
    unsure["solver"]["confirmed"] = False
    unasked["solver"]["rounds"][-1]["info"] = None

    assert "confirms the last round in 0.15 s: solved, 0 iterations" in line_of("SCS", report())
    assert "does not confirm" in line_of("SCS", unsure)
    assert "was not asked" in line_of("SCS", unasked)


def test_summary_of_a_kept_input_has_a_certificate_of_closeness_at_most() -> None:
    kept = report("unchanged") | {"certificate": None, "statement": None}
    proven = kept | {"statement": "every point within 1 m of the reference (proven)"}

    assert "none: the input was kept" in line_of("certificate", kept)
    assert "of closeness alone: the input was kept" in line_of("certificate", proven)


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        ("improved", "40 times closer"),
        ("indistinguishable", "lay on the reference already"),
        ("undecided", "equally close"),
        ("unchanged", "no vertex moved"),
        ("kept", "worse somewhere"),
        ("misaligned", "do not fit"),
        ("reference_copy", "no refinement"),
        ("worse", "farther"),
    ],
)
def test_every_outcome_is_put_into_words(outcome: str, words: str) -> None:
    assert words in line_of("outcome", report(outcome))


@pytest.mark.parametrize(
    ("mean", "words"),
    [
        (0.0085, "1.18 times closer"),
        (0.00998, "by less than 1 %"),
        (1e-8, "1,000,000 times closer"),
    ],
)
def test_small_and_large_improvements_are_written_with_the_digits_they_need(
    mean: float, words: str
) -> None:
    changed = report("improved")
    changed["quality"]["refined"]["point_to_surface"]["mean"] = mean

    assert words in line_of("outcome", changed)
