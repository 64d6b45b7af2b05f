"""The commands as their help describes them."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from service.cli import command_line
from tests.references.tables import NONE, table

_NOUNS = {Path: "PATH", int: "N", float: "NUMBER"}


def commands() -> Iterator[str]:
    """Every command, with its arguments and options."""
    yield from _of_group(typer.main.get_command(command_line()), "meshcone")


def _of_group(group: Any, path: str) -> Iterator[str]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _of_group(command, f"{path} {name}")
        else:
            yield from _of_command(command, f"{path} {name}")


def _of_command(command: Any, path: str) -> Iterator[str]:
    shown = [each for each in command.params if not getattr(each, "hidden", False)]
    arguments = [each for each in shown if each.param_type_name == "argument"]
    options = [each for each in shown if each.param_type_name == "option"]
    yield f"## {path}"
    yield ""
    usage = [path, *(["[OPTIONS]"] if options else []), *map(_usage, arguments)]
    yield f"`{' '.join(usage)}`"
    yield ""
    for paragraph in inspect.cleandoc(command.help).split("\n\n"):
        yield " ".join(paragraph.split())
        yield ""
    if arguments:
        rows = ((f"`{each.metavar}`", _plain(each.help)) for each in arguments)
        yield from table(("argument", "meaning"), rows)
        yield ""
    if options:
        yield from table(("option", "default", "meaning"), map(_option, options))
        yield ""


def _usage(argument: Any) -> str:
    return str(argument.metavar) if argument.required else f"[{argument.metavar}]"


def _option(option: Any) -> tuple[str, ...]:
    names = "`, `".join(option.opts)
    noun = option.metavar or _NOUNS.get(option.type_descriptor.annotation, "TEXT")
    takes = "" if option.is_flag else f" {noun}"
    return f"`{names}{takes}`", _default(option), _plain(option.help) + _range(option)


def _default(option: Any) -> str:
    if option.required:
        return "required"
    return NONE if option.default in (None, False, ()) else f"`{option.default}`"


def _range(option: Any) -> str:
    least, most = option.min, option.max
    if least is None:
        return ""
    return f" At least {least:,}." if most is None else f" From {least:,} to {most:,}."


def _plain(text: str | None) -> str:
    return " ".join((text or "").split())
