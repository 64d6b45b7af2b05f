"""What the demonstration's pictures have in common. Importing this imports no matplotlib."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = "#22303c"
FAINT = "#8795a1"
BEFORE_COLOUR = "#d1495b"
AFTER_COLOUR = "#1b7f8c"

_DPI = 110


def new_figure(width: float, height: float) -> Figure:
    """A figure of so many inches, drawn without a display and without global state."""
    import logging

    # Before it is imported: it tells of its font cache while it is.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def finish(axes: Axes, title: str) -> None:
    """Give a diagram its title and the look all diagrams share."""
    axes.set_title(title, fontsize=12, color=INK, loc="left", pad=10)
    axes.tick_params(labelsize=9, colors=INK)
    axes.tick_params(axis="x", length=0)
    axes.grid(axis="y", color="#e6eaed", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)


def png(figure: Figure) -> bytes:
    """The figure as a PNG file."""
    target = io.BytesIO()
    figure.savefig(target, format="png")
    return target.getvalue()
