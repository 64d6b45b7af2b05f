"""The distances of each part as a table for a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from meshcone.text import printable
from service.cli.metrics_table import written

if TYPE_CHECKING:
    from rich.table import Table

_SHOWN = 30
_FOUND = {"both": "", "missing": "MISSING", "extra": "extra"}
_COLUMNS = ("mean", "max")


def parts_table(per: Mapping[str, Any]) -> Table:
    """A row for each part, the worst first: what is missing of it, and what is there besides."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    left = per["count"] - min(len(per["parts"]), _SHOWN)
    caption = f"and {left:,} more that are no worse" if left else None
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, caption=caption, caption_justify="left")
    table.add_column(per["by"], overflow="fold")
    table.add_column("")
    for side in ("missing", "extra"):
        for name in _COLUMNS:
            table.add_column(f"{side}\n{name}", justify="right")
    for part in per["parts"][:_SHOWN]:
        cells = [
            "-" if part[side] is None else written(name, part[side][name])
            for side in ("missing", "extra")
            for name in _COLUMNS
        ]
        shown = Text(printable(part["name"] or "(no name)"))  # a string would be read as markup
        table.add_row(shown, _FOUND[part["found"]], *cells)
    return table
