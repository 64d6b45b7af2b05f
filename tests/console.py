"""The console examples of a document, run as somebody would paste them.

In a block of the language ``console`` a line that begins with ``$`` is a command, one that begins
with ``>`` goes on with it, and the others are what it prints. ``…`` stands for anything, in a line
of its own for any lines. Numbers may differ by a twentieth, because processors round differently.

``python -m tests.console README.md docs/tutorial.md`` runs the documents' examples, and writes into
them what was printed. They run among the files that a demo leaves or, where the document says so,
among those that ``examples/make_files.py`` makes.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from http.server import SimpleHTTPRequestHandler
from pathlib import Path
from typing import Self

from tests.listening import Silent, listening
from tests.serving import starting

MAKER = Path(__file__).parents[1] / "examples" / "make_files.py"
FILE_SERVER = "python -m http.server --bind 127.0.0.1 8001"
ADDRESSES = {"meshcone serve": "127.0.0.1:8000", FILE_SERVER: "127.0.0.1:8001"}
"""Where the servers of every example listen; those that run listen elsewhere."""

TOLERANCE = 0.05  # of a number
_TIMEOUT = 300  # seconds; a guard, not an expectation
_BLOCK = re.compile(r"(^```console\n)(.*?)(^```$)", re.MULTILINE | re.DOTALL)
_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+(?:,\d{3})*(?:\.\d+)?|\.\d+)(?:e[-+]?\d+)?(?![\w.]*\w)")
_IDENTIFIER = re.compile(r"[0-9a-f]{8}-[0-9a-f]{4}-7[0-9a-f]{3}-[0-9a-f]{4}-[0-9a-f]{12}")
_ASSIGNMENTS = re.compile(r"(?:\w+=\S+ )*")
_END = "end-of-a-command"


@dataclass(frozen=True)
class Example:
    """A command and what the document says that it prints."""

    command: str
    shown: tuple[str, ...]


def examples(text: str) -> list[Example]:
    """Every command of a document, in order."""
    return [each for block in _BLOCK.finditer(text) for each in _examples_of(block[2])]


def _examples_of(block: str) -> list[Example]:
    commands: list[tuple[str, list[str]]] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            commands.append((line[2:], []))
        elif (line + " ").startswith("> ") and commands and not commands[-1][1]:
            commands[-1] = (commands[-1][0] + "\n" + line[2:], [])
        else:
            commands[-1][1].append(line)
    return [Example(command, tuple(shown)) for command, shown in commands]


def agree(shown: Sequence[str], printed: Sequence[str]) -> bool:
    """Whether what was printed is what the document shows."""
    if not shown:
        return not printed
    if shown[0] == "…":
        return any(agree(shown[1:], printed[start:]) for start in range(len(printed) + 1))
    return bool(printed) and _alike(shown[0], printed[0]) and agree(shown[1:], printed[1:])


def _alike(shown: str, printed: str) -> bool:
    words = [re.escape(_plain(part)) for part in shown.split("…")]
    if not re.fullmatch(".*".join(words), _plain(printed)):
        return False
    numbers = [_numbers(each) for each in (shown, printed)]
    if "…" in shown:
        return True
    pairs = zip(*numbers, strict=True)
    return all(abs(a - b) <= TOLERANCE * max(abs(a), abs(b)) for a, b in pairs)


def _plain(line: str) -> str:
    """A line without its numbers, identifiers, and what pads them."""
    return re.sub(r"\s+", " ", _NUMBER.sub("0", _IDENTIFIER.sub("job", line))).strip()


def _numbers(line: str) -> list[float]:
    found = _NUMBER.findall(_IDENTIFIER.sub("", line))
    return [float(each.replace(",", "")) for each in found]


class Shell:
    """One shell for all examples of a document, in the directory of its files.

    ``meshcone serve`` starts a service beside it, which lives as long as the shell.
    """

    def __init__(self, directory: Path, home: Path) -> None:
        self._directory = directory
        self._stack = ExitStack()
        self._addresses: dict[str, str] = {}
        scripts = Path(sys.executable).parent
        kept = {name: value for name, value in os.environ.items() if name in ("LANG", "LC_ALL")}
        self._process = subprocess.Popen(
            ["bash", "--noprofile", "--norc"],
            cwd=directory,
            env={
                **kept,
                "HOME": str(home),
                "PATH": f"{scripts}:{os.defpath}",
                "NO_PROXY": "*",
                "PYTHONUNBUFFERED": "1",
            },
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()
        self._stack.close()

    def run(self, command: str) -> list[str]:
        """The lines that a command prints."""
        assignments = _ASSIGNMENTS.match(command)[0]  # type: ignore[index]  # it matches nothing, too
        if command.removeprefix(assignments) in ADDRESSES:
            return self._start(command.removeprefix(assignments), assignments)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{self._here(command)}\necho; echo {_END}\n")
        self._process.stdin.flush()
        printed = []
        for line in self._process.stdout:
            if line.rstrip("\n") == _END:
                break
            printed.append(self._shown(line.rstrip()))
        while printed and not printed[-1]:
            printed.pop()
        return printed

    def _here(self, command: str) -> str:
        for shown, real in self._addresses.items():
            command = command.replace(shown, real)
        return command

    def _shown(self, line: str) -> str:
        for shown, real in self._addresses.items():
            line = line.replace(real, shown)
        return line

    def _start(self, server: str, assignments: str) -> list[str]:
        shown = ADDRESSES[server]
        if server == FILE_SERVER:
            address = self._stack.enter_context(
                listening(partial(_Files, directory=str(self._directory)))
            )
            said = "Serving HTTP on 127.0.0.1 port 8001 (http://127.0.0.1:8001/) ..."
        else:
            files = Path(self._stack.enter_context(tempfile.TemporaryDirectory()))
            settings = dict(each.split("=", 1) for each in assignments.split())
            service = self._stack.enter_context(starting(files, **settings))
            address = service.url().removeprefix("http://")
            said = f"MeshCone listens on http://{shown} (Ctrl-C ends it)"
        self._addresses[shown] = address
        return [said]


class _Files(Silent, SimpleHTTPRequestHandler):
    """Python's own file server."""


@contextmanager
def demo_files() -> Iterator[Path]:
    """An empty home in which the demo was run; the directory of its files."""
    with tempfile.TemporaryDirectory(prefix="meshcone-examples-") as home:
        subprocess.run(
            [sys.executable, "-m", "service.cli", "demo"],
            cwd=home,
            env={**os.environ, "HOME": home},
            check=True,
            capture_output=True,
            timeout=_TIMEOUT,
        )
        yield Path(home) / "meshcone-demo"


@contextmanager
def made_files() -> Iterator[Path]:
    """An empty home in which the files of the how-tos were made; their directory."""
    with tempfile.TemporaryDirectory(prefix="meshcone-how-tos-") as home:
        subprocess.run([sys.executable, MAKER], cwd=home, check=True, capture_output=True)
        yield Path(home) / "meshcone-files"


def how_tos() -> list[Path]:
    """The documents whose examples run among the made files."""
    documents = sorted((MAKER.parents[1] / "docs").glob("*.md"))
    return [each for each in documents if _works_on_made_files(each.read_text())]


def _works_on_made_files(text: str) -> bool:
    return f"python examples/{MAKER.name}" in text


def _rewritten(text: str, shell: Shell) -> str:
    """A document with what its commands print now; lines with … stay as they are."""

    def block(match: re.Match[str]) -> str:
        lines: list[str] = []
        for example in _examples_of(match[2]):
            printed = shell.run(example.command)
            shown = example.shown if agree(example.shown, printed) else tuple(printed)
            command = [f"> {each}".rstrip() for each in example.command.splitlines()]
            lines += ["$ " + command[0].removeprefix("> "), *command[1:], *shown]
        return match[1] + "".join(f"{line}\n" for line in lines) + match[3]

    return _BLOCK.sub(block, text)


def main(documents: Sequence[str]) -> None:
    """Write into each document what its commands print."""
    for document in map(Path, documents):
        text = document.read_text()
        among = made_files if _works_on_made_files(text) else demo_files
        with among() as files, Shell(files, files.parent) as shell:
            document.write_text(_rewritten(text, shell))


if __name__ == "__main__":
    main(sys.argv[1:])
