"""A running installation, kept up as `meshcone serve` keeps it up."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from service.stack import Stack
from tests.holding import Hold
from worker.settings import WorkerSettings

_LOOK_INTERVAL = 0.2  # seconds


@contextmanager
def restarted_stack(
    settings: WorkerSettings, hold: Hold, *, workers: int, log: Path
) -> Iterator[Stack]:
    """Broker, API and workers, each started again when it ends; their jobs can be held."""
    with hold.stack(settings, workers=workers, log=log) as stack:
        stopping = threading.Event()

        def look() -> None:
            while not stopping.wait(_LOOK_INTERVAL):
                stack.restart_ended()

        thread = threading.Thread(target=look, daemon=True)
        thread.start()
        try:
            yield stack
        finally:
            stopping.set()
            thread.join()
