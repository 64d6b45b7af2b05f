"""A running installation, kept up as `meshcone serve` keeps it up."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from service.stack import Stack
from worker.settings import WorkerSettings

_LOOK_INTERVAL = 0.2  # seconds


@contextmanager
def mended_stack(settings: WorkerSettings, *, workers: int, log: Path) -> Iterator[Stack]:
    """Broker, API and workers, each started again when it ends."""
    with Stack(settings, workers=workers, log=log) as stack:
        stopping = threading.Event()

        def mend() -> None:
            while not stopping.wait(_LOOK_INTERVAL):
                stack.mend()

        thread = threading.Thread(target=mend, daemon=True)
        thread.start()
        try:
            yield stack
        finally:
            stopping.set()
            thread.join()
