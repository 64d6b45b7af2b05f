from __future__ import annotations

from typing import Any

import pytest

from service.demo.convergence import draw_convergence

METHODS = ("relaxation", "multipliers", "scs")


def report(logged: list[int], value: float) -> dict[str, Any]:
    """A report with so many iterations logged in each round; 0 where SCS was not asked."""
    mean = {"point_to_surface": {"mean": 0.01}}
    residuals = {"primal": 0.0, "dual": 1e-7, "gap": abs(value), "complementarity": 1e-9}
    return {
        "options": {"solver": {"tolerance": 1e-5}},
        "quality": {"input": mean, "refined": mean},
        "certificate": {"optimum": residuals, "written": residuals},
        "solver": {
            "rounds": [
                {
                    "round": number,
                    "method": METHODS[number % 3],
                    "movement": 0.0 if number > 1 else 0.1,
                    "info": {"iterations": length - 1} if length else None,
                    "history": history(length, value) if length else {},
                }
                for number, length in enumerate(logged, start=1)
            ]
        },
    }


def history(length: int, gap: float) -> dict[str, list[float]]:
    return {
        "iter": [float(number) for number in range(length)],
        "res_pri": [1e-15] * length,
        "res_dual": [1e-6] * length,
        "gap": [gap] * length,
    }


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("logged", [[1], [0, 0, 0, 0, 1], [0, 0, 0], [400, 1, 12], [0, 30, 1]])
@pytest.mark.parametrize("value", [1e-6, -1e-6, 0.0, 1e300])
def test_any_report_can_be_drawn(logged: list[int], value: float) -> None:
    assert draw_convergence(report(logged, value)).startswith(b"\x89PNG")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("logged", [[1], [0, 0]])
def test_a_report_without_a_certificate_can_be_drawn(logged: list[int]) -> None:
    assert draw_convergence(report(logged, 0.0) | {"certificate": None}).startswith(b"\x89PNG")
