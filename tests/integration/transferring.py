"""The process that moves files, into and out of a store without workers."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from redis import Redis

from tests.integration.jobs import make_job
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import FETCHES
from worker.jobs.records import JobProgress, JobRecord, RemoteFile
from worker.settings import WorkerSettings

MUG = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

Transfer = Callable[..., AbstractContextManager["subprocess.Popen[bytes]"]]


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


def remote_job(ledger: Ledger, source: str | RemoteFile, **more: object) -> JobRecord:
    """An incomplete job in the ledger, whose source is at a URL, and which has no reference."""
    file = RemoteFile(name="mug.obj", url=source) if isinstance(source, str) else source
    fields = {"source": file, "reference": None, "progress": JobProgress.fetching(), **more}
    record = make_job().model_copy(update=fields)
    ledger.create(record)
    return record


def ended_fetching(redis: Redis, job: JobRecord) -> bool:
    """Whether nothing of a job is still to be fetched."""
    return redis.zscore(FETCHES, job.id) is None
