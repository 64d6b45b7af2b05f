"""What commands say, in lines that leave a terminal as it is."""

from __future__ import annotations

import typer

from meshcone.text import printable


def tell(line: str, *, err: bool = False) -> None:
    """Print a line, in which files may have put names of their own.

    Names are told as they are: nothing in them is taken for markup, and what would steer a
    terminal is written as its escape.
    """
    typer.echo(printable(line), err=err)
