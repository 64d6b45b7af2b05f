"""Arguments of commands, and how what they say is printed."""

from __future__ import annotations

import io
import sys

import pytest
import typer

from meshcone.errors import InputError
from service.cli.arguments import options_from
from service.cli.boundary import CommandLine


def test_an_argument_adds_to_no_number() -> None:
    with pytest.raises(InputError, match=r"option 'detail': expected options in it.*found 5"):
        options_from(["detail=5"], detail="4x")
    with pytest.raises(InputError, match=r"option 'quality': expected options in it.*found 5"):
        options_from(["quality=5"], per="node")


def test_a_value_that_is_nested_too_deeply_is_refused() -> None:
    with pytest.raises(InputError, match="option 'select': the value is nested too deeply"):
        options_from([f"select={'[' * 60_000}"])


@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "ascii"])
def test_what_a_terminal_cannot_show_is_escaped(
    encoding: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding, write_through=True))
    commands = CommandLine()

    @commands.command()
    def say() -> None:
        print("one → \udcff two")

    with pytest.raises(SystemExit) as ended:
        commands([])
    assert (ended.value.code, shown.getvalue()) == (0, b"one \\u2192 \\udcff two\n")


def test_names_of_files_that_are_no_text_pass_through_where_they_can(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shown = io.BytesIO()
    stream = io.TextIOWrapper(shown, "utf-8", errors="surrogateescape", write_through=True)
    monkeypatch.setattr(sys, "stdout", stream)
    commands = CommandLine()

    @commands.command()
    def say() -> None:
        typer.echo("→ \udcff")

    with pytest.raises(SystemExit):
        commands([])
    assert shown.getvalue() == "→ ".encode() + b"\xff\n"
