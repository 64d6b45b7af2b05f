"""The half of the convergence picture that shows residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from service.demo.figures import FAINT, INK, finish

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LOGGED = (
    ("res_pri", "primal residual", "#2f6690", "o"),
    ("res_dual", "dual residual", "#e08e45", "s"),
    ("gap", "duality gap", "#7a5195", "^"),
)
_CERTIFIED = (
    ("primal", "largest\ncone violation"),
    ("dual", "dual\nresidual"),
    ("gap", "duality\ngap"),
    ("complementarity", "slack of\nactive cones"),
)
_POINTS = (
    ("optimum", "at the optimum", "#1b7f8c", "o"),
    ("written", "as the file stores it", "#e08e45", "s"),
)
SMALLEST = 1e-17  # below the rounding of the numbers themselves; a logarithm needs a floor
_LARGEST = 1e30  # SCS logs infinity before it has an estimate
_FEW_ITERATIONS = 12  # with no more than these, each is marked


def draw_residuals(axes: Axes, report: dict[str, Any]) -> None:
    """Draw SCS's iterations where it had to iterate, the certificate where it had not."""
    rounds = [record for record in report["solver"]["rounds"] if record["history"]]
    iterated = [record for record in rounds if record["info"]["iterations"]]
    if report["certificate"] is None and not rounds:
        axes.set_axis_off()
        axes.set_title("The input was kept: nothing to certify", fontsize=12, color=INK, loc="left")
        return
    if report["certificate"] is None or iterated:
        _draw_history(axes, rounds)
        finish(axes, "Residuals of SCS at each logged iteration")
    else:
        _draw_certificate(axes, report["certificate"])
        finish(axes, "Residuals of the last round, recomputed without the solver")
    axes.set_yscale("log")
    tolerance = report["options"]["solver"]["tolerance"]
    axes.axhline(tolerance, color=FAINT, linestyle="--", linewidth=1, label="tolerance")
    axes.legend(frameon=False, fontsize=10, labelcolor=INK, loc="center left")


def _draw_certificate(axes: Axes, certificate: dict[str, Any]) -> None:
    for offset, (point, label, colour, marker) in zip((-0.07, 0.07), _POINTS, strict=True):
        values = _plottable([certificate[point][name] for name, _ in _CERTIFIED])
        positions = np.arange(len(values)) + offset
        axes.plot(positions, values, marker, color=colour, markersize=9, label=label)
        for x, y, exact in zip(positions, values, certificate[point].values(), strict=True):
            axes.annotate(
                f"{exact:.1g}",
                (x, y),
                (9 if offset > 0 else -9, 0),
                textcoords="offset points",
                ha="left" if offset > 0 else "right",
                va="center",
                fontsize=9,
                color=colour,
            )
    axes.set_xlim(-0.8, len(_CERTIFIED) - 0.4)
    axes.set_xticks(range(len(_CERTIFIED)), [label for _, label in _CERTIFIED])


def _draw_history(axes: Axes, rounds: list[dict[str, Any]]) -> None:
    for place, record in enumerate(rounds):
        logged = len(record["history"]["iter"])
        # Every round is as wide as any other, or one long round would hide the rest.
        position = place - 0.5 + (np.arange(logged) + 0.5) / max(logged, 1)
        for column, label, colour, marker in _LOGGED:
            axes.plot(
                position,
                _plottable(record["history"][column]),
                color=colour,
                marker=marker if logged <= _FEW_ITERATIONS else None,
                markersize=7,
                linewidth=1.4,
                label=label if place == 0 else None,
            )
        if place % 2:
            axes.axvspan(place - 0.5, place + 0.5, color="#f1f4f6", zorder=0)
    labels = [
        f"round {each['round']}\n{_iterations(each['info']['iterations'])}" for each in rounds
    ]
    axes.set_xticks(range(len(rounds)), labels)
    axes.set_xlim(-0.5, max(len(rounds), 1) - 0.5)


def _plottable(values: list[float]) -> NDArray[np.float64]:
    """Magnitudes that a logarithmic axis can show; NaN where there is no estimate yet."""
    magnitudes = np.abs(np.asarray(values, dtype=np.float64))
    return np.where(magnitudes > _LARGEST, np.nan, magnitudes.clip(SMALLEST))


def _iterations(count: int) -> str:
    return f"{count} iteration" + ("" if count == 1 else "s")
