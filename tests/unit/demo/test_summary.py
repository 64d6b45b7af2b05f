from __future__ import annotations

import io
from typing import Any

import pytest
from rich.console import Console

from service.demo.summary import metrics_table, summary_lines


def report(outcome: str = "improved", iterations: int = 0) -> dict[str, Any]:
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
            "iterations": iterations,
            "rounds": [
                {
                    "sizes": {"variables": 14844, "cones": {"edge_cap": 14000, "pin": 832}},
                    "info": {"linear_solver": "sparse-direct-amd-qdldl"},
                }
            ],
        },
        "timings": {"solve": 1.234, "total": 2.0},
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


def test_summary_counts_cones_of_every_kind() -> None:
    assert "program        14,844 variables, 14,832 cones" in summary_lines(report())


def test_summary_explains_a_run_without_iterations() -> None:
    assert any("every warm start" in line for line in summary_lines(report(iterations=0)))
    assert not any("every warm start" in line for line in summary_lines(report(iterations=75)))


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        ("improved", "40 times closer"),
        ("indistinguishable", "equally close"),
        ("unchanged", "no vertex moved"),
        ("reference_copy", "no refinement"),
        ("worse", "farther"),
    ],
)
def test_every_outcome_is_put_into_words(outcome: str, words: str) -> None:
    (line,) = [line for line in summary_lines(report(outcome)) if line.startswith("outcome")]
    assert words in line
