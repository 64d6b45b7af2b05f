"""Jobs and workers without a front end."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from meshcone.files import MeshFile
from meshcone.options import OPTIONS_VERSION
from tests import shapes
from tests.integration.jobs import stored_job
from worker.broker.connections import connect_bytes, connect_text
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobRecord
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister

SMALL = {"effort": "fast", "quality": {"samples": 256, "emd_samples": 64}}


def sent(settings: WorkerSettings, ledger: Ledger, version: int = OPTIONS_VERSION) -> JobRecord:
    """A queued job that a program with some version of the options took in."""
    vertices, faces = shapes.sphere(1)
    with connect_text(settings.required_redis_url()) as connected:
        record = stored_job(
            BlobStore.open(settings, BlobRegister(connected)),
            MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces)),
            MeshFile("ball.obj", shapes.obj(vertices, faces)),
            options=SMALL,
            options_version=version,
        )
    ledger.create(record)
    with connect_bytes(settings.required_redis_url()) as connection:
        JobQueue(settings, connection).enqueue(record.id)
    return record


@contextmanager
def worker(
    settings: WorkerSettings, name: str, environment: Mapping[str, str]
) -> Iterator[tuple[subprocess.Popen[bytes], Path]]:
    """A worker process, until the block's end, and its log."""
    log = settings.data_dir / f"{name}.log"
    with log.open("wb") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "worker.main"],
            env={
                **os.environ,
                "MESHCONE_DATA_DIR": str(settings.data_dir),
                "MESHCONE_REDIS_URL": settings.required_redis_url(),
                "MESHCONE_RECONCILE_INTERVAL": str(settings.reconcile_interval),
                **environment,
            },
            stdout=file,
            stderr=file,
        )
        try:
            yield process, log
        finally:
            process.terminate()
            process.wait(240)
