"""Jobs that take as long as their test wants, on any machine."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from meshcone.files import MeshFile
from service.stack import Stack
from tests import held
from worker.settings import WorkerSettings


class Hold:
    """Keeps jobs at work until they are released; each then goes on and ends as any other.

    Args:
        directory: of its own; a file in it releases the jobs whose source is named like it.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self._names: list[str] = []

    def mesh(self, mesh: MeshFile) -> MeshFile:
        """The same mesh; a refinement that has it as its source waits once it has begun."""
        name = f"held_{uuid4().hex}{Path(mesh.name).suffix}"
        self._names.append(name)
        return replace(mesh, name=name)

    def release(self) -> None:
        """Let every job go on that was held so far."""
        for name in self._names:
            (self._directory / name).touch()

    @contextmanager
    def stack(self, settings: WorkerSettings, **arguments: Any) -> Iterator[Stack]:
        """An installation whose jobs can be held; all are released at the end."""
        stack = Stack(settings, **arguments)
        with pytest.MonkeyPatch.context() as environment:
            environment.setenv("HELD_JOBS", str(self._directory))
            environment.setenv("PYTHONPATH", held.__path__[0], prepend=os.pathsep)
            stack.start()  # its processes have this environment for as long as it lives
        try:
            yield stack
        finally:
            self.release()
            stack.stop()
