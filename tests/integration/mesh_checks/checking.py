"""Files that are sent to checks, and what their processes have open."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

from anyio.from_thread import BlockingPortal

from meshcone.options import Options
from service.api.checking.checks import MeshChecks, MeshFiles
from tests.integration.waiting import wait_for
from tests.processes import children_of

MEBIBYTE = 2**20

OPTIONS = Options()

Keep = Callable[..., MeshFiles]


class Pipe(io.BytesIO):
    """A file that is read when the test has written it, and not before."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        os.mkfifo(path)
        self._path = path
        self._descriptor = os.open(path, os.O_RDWR)

    def fileno(self) -> int:
        return self._descriptor

    def give(self, data: bytes) -> None:
        os.write(self._descriptor, data)
        os.close(self._descriptor)

    def reader(self, checks: MeshChecks, *, but: int = 0) -> int:
        """The process of a check that has been handed this file."""
        found: list[int] = []

        def look() -> bool:
            found[:] = [pid for pid in children_of(checks.pid) if pid != but and self.is_at(pid)]
            return bool(found)

        wait_for(look)
        return found[0]

    def is_at(self, pid: int) -> bool:
        return str(self._path) in open_files(pid)


def open_files(pid: int) -> list[str]:
    try:
        return [str(link.readlink()) for link in Path(f"/proc/{pid}/fd").iterdir()]
    except FileNotFoundError:
        return []


def begun(
    portal: BlockingPortal, checks: MeshChecks, source: MeshFiles, reference: MeshFiles
) -> Future[bool]:
    return portal.start_task_soon(checks.check, source, reference, OPTIONS)


def checked(
    portal: BlockingPortal, checks: MeshChecks, source: MeshFiles, reference: MeshFiles
) -> bool:
    return portal.call(checks.check, source, reference, OPTIONS)
