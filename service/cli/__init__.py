"""The command line: one module a command, put together here."""

import sys
from importlib import import_module
from importlib.metadata import version
from typing import Annotated

import typer

from service.cli.boundary import CommandLine

_COMMANDS = (  # in the order of the help
    "demo",
    "refine",
    "measure",
    "audit",
    "gate",
    "thresholds",
    "verify",
    "submit",
    "serve",
    "api",
    "worker",
    "webhooks",
    "transfers",
    "keys",
    "openapi",
)


def app() -> None:
    """Run the command that the arguments name, and exit."""
    named = sys.argv[1:2]
    command_line(*(named if named and named[0] in _COMMANDS else _COMMANDS))()


def command_line(*names: str) -> CommandLine:
    """The command line with some commands, or with all.

    Each is imported here: all of them take longer than most take to answer.
    """
    line = CommandLine(
        name="meshcone",
        add_completion=False,
        no_args_is_help=True,
        rich_markup_mode=None,
    )
    line.callback()(_main)
    for name in names or _COMMANDS:
        module = import_module(f"service.cli.{name}")
        if hasattr(module, "commands"):
            line.add_typer(module.commands, name=name)
        else:
            line.command(name)(module.command)
    return line


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"meshcone {version('meshcone')}")
        raise typer.Exit


def _main(
    _version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_show_version,
            is_eager=True,
            help="Print the version and exit.",
            show_default=False,
        ),
    ] = False,
) -> None:
    """Refine a mesh against a reference, with proof that the answer is optimal."""


__all__ = ["app", "command_line"]
