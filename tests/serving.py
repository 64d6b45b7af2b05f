"""`meshcone serve`, as an operator runs it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.processes import children_of


@dataclass(frozen=True)
class Service:
    """A running service.

    Attributes:
        process: what was started.
        log: what it and its children write to stderr.
    """

    process: subprocess.Popen[str]
    log: Path

    def url(self) -> str:
        """Where it listens; waits until it says so."""
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line.startswith("MeshCone listens on http://"), self.log.read_text()
        return line.split()[3]

    def workers(self) -> list[int]:
        """Process ids of the workers that have not ended."""
        return [pid for pid in children_of(self.process.pid) if _runs(pid, b"worker")]


@contextmanager
def starting(
    directory: Path, *arguments: str, within: Sequence[str] = (), **environment: str
) -> Iterator[Service]:
    """Start it in a directory; ``within`` is a command that runs another."""
    log = directory / "log"
    command = [sys.executable, "-m", "service.cli", "serve", "--port", "0", *arguments]
    with log.open("w") as stderr:
        process = subprocess.Popen(
            [*within, *command],
            cwd=directory,
            env={**os.environ, **environment},
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
        )
    try:
        yield Service(process, log)
    finally:
        process.kill()
        process.communicate()


@contextmanager
def serving(directory: Path, *arguments: str, **environment: str) -> Iterator[Service]:
    """Start it and wait until it listens."""
    with starting(directory, *arguments, **environment) as service:
        service.url()
        yield service


def _runs(pid: int, command: bytes) -> bool:
    try:
        arguments = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
    except (FileNotFoundError, ProcessLookupError):
        return False
    return b"service.cli" in arguments and command in arguments
