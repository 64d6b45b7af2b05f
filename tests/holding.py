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
        sources: what the names of the sources begin with whose jobs are held.
    """

    def __init__(self, directory: Path, sources: str = "held_") -> None:
        self._directory = directory
        self._sources = sources
        self._names: list[str] = []

    def mesh(self, mesh: MeshFile) -> MeshFile:
        """The same mesh; a refinement that has it as its source waits once it has begun."""
        name = f"{self._sources}{uuid4().hex}{Path(mesh.name).suffix}"
        self._names.append(name)
        return replace(mesh, name=name)

    def release(self) -> None:
        """Let every job go on that was held so far."""
        for name in self._names:
            (self._directory / name).touch()

    def environment(self) -> dict[str, str]:
        """What has to be in the environment of an installation whose jobs can be held."""
        paths = [held.__path__[0], *filter(None, [os.environ.get("PYTHONPATH")])]
        return {
            "PYTHONPATH": os.pathsep.join(paths),
            "HELD_JOBS": str(self._directory),
            "HELD_SOURCES": self._sources,
        }

    @contextmanager
    def stack(self, settings: WorkerSettings, **arguments: Any) -> Iterator[Stack]:
        """An installation whose jobs can be held; all are released at the end."""
        stack = Stack(settings, **arguments)
        with pytest.MonkeyPatch.context() as patch:
            for name, value in self.environment().items():
                patch.setenv(name, value)
            stack.start()  # its processes have this environment for as long as it lives
        try:
            yield stack
        finally:
            self.release()
            stack.stop()
