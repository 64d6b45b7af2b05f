"""The picture of how optimal the answer is and how the surface settled, round by round."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from service.demo.figures import AFTER_COLOUR, BEFORE_COLOUR, INK, finish, new_figure, png
from service.demo.residuals import SMALLEST, draw_residuals

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_METHODS = (
    ("relaxation", "no cone in the way", "o"),
    ("multipliers", "active cones, dual method", "s"),
    ("scs", "SCS", "^"),
)


def draw_convergence(report: dict[str, Any]) -> bytes:
    """Draw the residuals, and the movement of every round.

    Args:
        report: of a refinement.

    Returns:
        A PNG file.
    """
    figure = new_figure(11.6, 4.3)
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
    draw_residuals(left, report)
    _draw_rounds(right, report)
    figure.tight_layout(w_pad=3)
    return png(figure)


def _draw_rounds(axes: Axes, report: dict[str, Any]) -> None:
    rounds = report["solver"]["rounds"]
    number = [record["round"] for record in rounds]
    movement = [100 * max(record["movement"], SMALLEST) for record in rounds]
    axes.plot(number, movement, color=INK, linewidth=1.4)
    for method, label, marker in _METHODS:
        solved = [i for i, record in enumerate(rounds) if record["method"] == method]
        if solved:
            points = [number[i] for i in solved], [movement[i] for i in solved]
            axes.plot(*points, marker, color=INK, markersize=7, label=label)
    for x, y in zip(number, movement, strict=True):
        axes.annotate(f"{y:.2g}", (x, y), (6, 6), textcoords="offset points", fontsize=9, color=INK)
    for name, colour in (("input", BEFORE_COLOUR), ("refined", AFTER_COLOUR)):
        _draw_distance(
            axes, name, 100 * report["quality"][name]["point_to_surface"]["mean"], colour
        )
    axes.set_yscale("log")
    axes.margins(y=0.12)
    axes.set_xlim(number[0] - 0.4, number[-1] + 0.6)
    axes.set_xticks(number, [str(value) for value in number])
    axes.set_xlabel("round", fontsize=9, color=INK)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g} %")
    axes.legend(frameon=False, fontsize=9, labelcolor=INK, loc="upper right")
    finish(axes, "RMS movement in each round, % of the radius")


def _draw_distance(axes: Axes, name: str, mean: float, colour: str) -> None:
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
