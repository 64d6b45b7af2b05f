"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterator

NONE = "–"  # noqa: RUF001 - how a table says that there is none


def table(header: tuple[str, ...], rows: Iterator[tuple[str, ...]]) -> Iterator[str]:
    """The lines of a table; cells are Markdown, in which a bar would end them."""
    yield _line(header)
    yield f"|{'---|' * len(header)}"
    for row in rows:
        yield _line(row)


def _line(cells: tuple[str, ...]) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"
