"""The console examples of the README and the tour, run in an empty home after a demo."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.console import Example, Shell, agree, demo_files, examples

ROOT = Path(__file__).parents[2]

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]  # a guard: each runs many commands


@pytest.fixture(scope="module")
def files() -> Iterator[Path]:
    with demo_files() as directory:
        yield directory


@pytest.mark.parametrize("document", ["README.md", "docs/tutorial.md"])
def test_the_commands_of_a_document_print_what_it_shows(files: Path, document: str) -> None:
    shown = examples((ROOT / document).read_text())

    with Shell(files, files.parent) as shell:
        printed = [shell.run(example.command) for example in shown]

    assert len(shown) > 5
    for example, lines in zip(shown, printed, strict=True):
        assert agree(example.shown, lines), "\n".join([f"$ {example.command}", *lines])


def test_a_command_is_what_follows_a_dollar_and_the_rest_is_what_it_prints() -> None:
    text = "words\n```console\n$ first \\\n> goes on\none\ntwo\n$ second\n```\n```sh\n$ no\n```\n"

    assert examples(text) == [
        Example("first \\\ngoes on", ("one", "two")),
        Example("second", ()),
    ]


@pytest.mark.parametrize(
    ("shown", "printed", "agreed"),
    [
        (["mean 0.0974 → 1.2e-05"], ["mean 0.0975 → 1.21e-05"], True),
        (["mean 0.0974"], ["mean 0.2974"], False),
        (["ok    12,345 faces"], ["ok 12,346 faces"], True),
        (["improved"], ["kept"], False),
        (["worst 1 at …"], ["worst 1 at (3, 4, 5)"], True),
        (["a", "…", "z"], ["a", "b", "c", "z"], True),
        (["a", "…", "z"], ["a", "b"], False),
        (["a"], ["a", "b"], False),
        ([], ["a"], False),
        (["out2.glb"], ["out3.glb"], False),
    ],
)
def test_what_is_printed_may_differ_in_the_rounding_of_numbers_alone(
    shown: list[str], printed: list[str], agreed: bool
) -> None:
    assert agree(shown, printed) is agreed
