"""Arguments of commands, and how what they say is printed."""

from __future__ import annotations

import io
import os
import sys

import pytest
import rich.console
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


def saying(stream: str, monkeypatch: pytest.MonkeyPatch, file: int) -> int:
    """The exit code of a command that ends with 1, as a gate that fails, and says it there."""
    monkeypatch.setattr(sys, stream, io.TextIOWrapper(os.fdopen(file, "wb")))
    commands = CommandLine()

    @commands.command()
    def judge() -> int:
        for _ in range(2):
            typer.echo("it fails", err=stream == "stderr")
            rich.console.Console(stderr=stream == "stderr").print("it fails")
        return 1

    with pytest.raises(SystemExit) as ended:
        commands([])
    assert isinstance(ended.value.code, int)
    return ended.value.code


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_a_reader_that_has_enough_changes_no_exit_code(
    stream: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    reading, writing = os.pipe()
    os.close(reading)

    assert saying(stream, monkeypatch, writing) == 1


def test_output_that_finds_no_room_is_said_and_no_verdict(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code = saying("stdout", monkeypatch, os.open("/dev/full", os.O_WRONLY))

    told = "meshcone: standard output cannot be written: no space left on device\n"
    assert (code, capsys.readouterr().err) == (2, told)
