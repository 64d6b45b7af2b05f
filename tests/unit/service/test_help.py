"""What the command line says of itself on a terminal of 80 columns."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from service.cli import command_line


@pytest.mark.parametrize("command", [[], ["keys"]])
def test_no_command_is_described_by_half_a_sentence(
    command: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")

    shown = CliRunner().invoke(command_line(), [*command, "--help"])

    commands = shown.stdout.partition("Commands:\n")[2].splitlines()
    assert shown.exit_code == 0
    assert len(commands) > 2
    assert [line for line in commands if not line.endswith(".")] == []
    assert "..." not in "".join(commands)
    assert "…" not in shown.stdout
