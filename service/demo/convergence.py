"""The picture of how the solver converged and how the surface settled, round by round."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from service.demo.figures import AFTER_COLOUR, BEFORE_COLOUR, FAINT, INK, new_figure, png

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RESIDUALS = (
    ("res_pri", "primal residual", "#2f6690", "o"),
    ("res_dual", "dual residual", "#e08e45", "s"),
    ("gap", "duality gap", "#7a5195", "^"),
)
_FEW_ITERATIONS = 12  # with no more than these, each is marked
_SMALLEST = 1e-17  # below the rounding of the numbers themselves; a logarithm needs a floor
_LARGEST = 1e30  # SCS logs infinity before it has an estimate


def draw_convergence(report: dict[str, Any]) -> bytes:
    """Draw the residuals of every iteration, and the movement of every round.

    Args:
        report: of a refinement.

    Returns:
        A PNG file.
    """
    figure = new_figure(11.6, 4.3)
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
    _draw_residuals(left, report)
    _draw_rounds(right, report)
    figure.tight_layout(w_pad=3)
    return png(figure)


def _draw_residuals(axes: Axes, report: dict[str, Any]) -> None:
    rounds = report["solver"]["rounds"]
    for record in rounds:
        iterations = len(record["history"]["iter"])
        # Every round is as wide as any other, or one long round would hide the rest.
        position = record["round"] - 0.5 + (np.arange(iterations) + 0.5) / max(iterations, 1)
        for column, label, colour, marker in _RESIDUALS:
            axes.plot(
                position,
                _plottable(record["history"][column]),
                color=colour,
                marker=marker if iterations <= _FEW_ITERATIONS else None,
                markersize=7,
                linewidth=1.4,
                label=label if record is rounds[0] else None,
            )
        if record["round"] % 2 == 0:
            shade = (record["round"] - 0.5, record["round"] + 0.5)
            axes.axvspan(*shade, color="#f1f4f6", zorder=0)
    axes.set_yscale("log")
    axes.set_xlim(0.5, len(rounds) + 0.5)
    tolerance = report["options"]["solver"]["tolerance"]
    label = "tolerance, its absolute part"
    axes.axhline(tolerance, color=FAINT, linestyle="--", linewidth=1, label=label)
    axes.set_xticks(
        [record["round"] for record in rounds],
        [
            f"round {record['round']}\n{_iterations(record['info']['iterations'])}"
            for record in rounds
        ],
    )
    if all(record["info"]["iterations"] == 0 for record in rounds):
        axes.set_xlabel(
            "0 iterations: the warm start already met the tolerance", fontsize=9, color=FAINT
        )
    _finish(axes, "Residuals of SCS at each logged iteration")
    axes.legend(frameon=False, fontsize=10, labelcolor=INK, loc="center left")


def _plottable(values: list[float]) -> NDArray[np.float64]:
    """Magnitudes that a logarithmic axis can show; NaN where there is no estimate yet."""
    magnitudes = np.abs(np.asarray(values, dtype=np.float64))
    return np.where(magnitudes > _LARGEST, np.nan, magnitudes.clip(_SMALLEST))


def _draw_rounds(axes: Axes, report: dict[str, Any]) -> None:
    rounds = report["solver"]["rounds"]
    number = [record["round"] for record in rounds]
    movement = [100 * max(record["movement"], _SMALLEST) for record in rounds]
    axes.plot(number, movement, color=INK, marker="o", markersize=7, linewidth=1.4)
    for x, y in zip(number, movement, strict=True):
        axes.annotate(f"{y:.2g}", (x, y), (6, 6), textcoords="offset points", fontsize=9, color=INK)
    for name, colour in (("input", BEFORE_COLOUR), ("refined", AFTER_COLOUR)):
        mean = 100 * report["quality"][name]["point_to_surface"]["mean"]
        axes.axhline(mean, color=colour, linestyle="--", linewidth=1.2)
        axes.annotate(
            f"mean distance of the {name} mesh, {mean:.2g} %",
            (0.99, mean),
            xycoords=("axes fraction", "data"),
            xytext=(0, 4),
            textcoords="offset points",
            ha="right",
            fontsize=9,
            color=colour,
        )
    axes.set_yscale("log")
    axes.margins(y=0.12)
    axes.set_xlim(number[0] - 0.4, number[-1] + 0.6)
    axes.set_xticks(number, [f"round {value}" for value in number])
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g} %")
    _finish(axes, "RMS movement in each round, % of the radius")


def _iterations(count: int) -> str:
    return f"{count} iteration" + ("" if count == 1 else "s")


def _finish(axes: Axes, title: str) -> None:
    axes.set_title(title, fontsize=12, color=INK, loc="left", pad=10)
    axes.tick_params(labelsize=9, colors=INK)
    axes.tick_params(axis="x", length=0)
    axes.grid(axis="y", color="#e6eaed", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
