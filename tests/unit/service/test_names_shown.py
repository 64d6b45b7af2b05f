"""Names from files, as a terminal shows them: whole, and without steering it."""

from __future__ import annotations

from typing import Any

import pytest
from rich.console import Console
from rich.table import Table

from meshcone.errors import InputError
from meshcone.gates.results import GateRun
from meshcone.text import printable
from service.cli.boundary import CommandLine
from service.cli.gate import show_run
from service.cli.parts_table import parts_table
from service.gating.display import summary_table
from tests.unit.gates.runs import asset, broken, check

NAMES = ["a[/old]", "[bold]x[lod1]", "A/[red]name_1.obj", "a:bomb:"]
STEERING = "red\x1b[31m\x9b31m\u202egro"


def shown(table: Table) -> str:
    console = Console(width=200)
    with console.capture() as captured:
        console.print(table)
    return captured.get()


def parts(name: str) -> dict[str, Any]:
    part = {"name": name, "found": "both", "missing": None, "extra": None}
    return {"by": "group", "count": 1, "parts": [part]}


@pytest.mark.parametrize("name", NAMES)
def test_names_are_not_read_as_markup(name: str) -> None:
    assert name in shown(summary_table(GateRun.of([asset(name, check("pass"))])))
    assert name in shown(parts_table(parts(name)))


def test_names_steer_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    bad = [asset(STEERING, check("fail")), broken(STEERING, "input", f"{STEERING}: has no faces")]

    show_run(GateRun.of(bad))
    show_run(GateRun.of(bad[:1]))

    out, err = capsys.readouterr()
    assert "red\\x1b[31m\\x9b31m\\u202egro" in out
    assert not set("\x1b\x9b\u202e") & set(out + err + shown(parts_table(parts(STEERING))))


def test_a_message_steers_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    commands = CommandLine()

    @commands.command()
    def fail() -> None:
        raise InputError("cannot be read", file="a\x1b[2Jb.obj")

    with pytest.raises(SystemExit):
        commands([])

    assert capsys.readouterr().err == "meshcone: a\\x1b[2Jb.obj: cannot be read\n"


def test_letters_spaces_and_bytes_that_are_no_text_are_shown_as_they_are() -> None:
    for name in ("Kanne \u00fc", "\u58fa\u3000\u00a0", "\udcff.obj"):
        assert printable(name) == name


def test_an_end_of_a_line_in_a_name_ends_no_line() -> None:
    assert printable("a\nb\u2028c\x85") == "a\\nb\\u2028c\\x85"
