"""The commands of the how-tos, run among the files that examples/make_files.py makes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.console import Shell, agree, examples, how_tos, made_files

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]  # a guard: each runs many commands


@pytest.fixture(scope="module")
def files() -> Iterator[Path]:
    with made_files() as directory:
        yield directory


@pytest.mark.parametrize("document", how_tos(), ids=lambda path: path.stem)
def test_the_commands_of_a_how_to_print_what_it_shows(files: Path, document: Path) -> None:
    shown = examples(document.read_text())

    with Shell(files, files.parent) as shell:
        printed = [shell.run(example.command) for example in shown]

    assert shown
    for example, lines in zip(shown, printed, strict=True):
        assert agree(example.shown, lines), "\n".join([f"$ {example.command}", *lines])
