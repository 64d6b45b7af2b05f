"""The process that moves files, into and out of a store without workers."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from worker.settings import WorkerSettings


@contextmanager
def transferring(settings: WorkerSettings, **more: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run the process while the body is worked through; it logs beside the store."""
    environment = {
        **os.environ,
        "MESHCONE_REDIS_URL": settings.required_redis_url(),
        "MESHCONE_DATA_DIR": str(settings.data_dir),
        "MESHCONE_TRANSFER_PRIVATE_ADDRESSES": "true",
        "MESHCONE_FETCH_FIRST_DELAY": "0.05",
        "MESHCONE_OUTPUT_FIRST_DELAY": "0.05",
        **more,
    }
    command = [sys.executable, "-m", "service.cli", "transfers"]
    with (settings.data_dir / "transfers.log").open("ab") as log:
        process = subprocess.Popen(command, env=environment, stderr=log)
    try:
        yield process
    finally:
        process.terminate()
        assert process.wait(20) in (0, -signal.SIGKILL)
