"""Ledger entries, with and without files behind them."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from meshcone.files import MeshFile
from meshcone.options import Options
from worker.jobs.identifiers import new_job_id
from worker.jobs.records import JobRecord, StoredFile
from worker.storage.blobs import BlobStore


def make_job(label: str | None = None) -> JobRecord:
    file = StoredFile(name="mug.obj", digest="0" * 64, size=1)
    return JobRecord(
        id=new_job_id(),
        created=datetime.now(UTC),
        labels=() if label is None else (label,),
        source=file,
        reference=file,
        options=Options().model_dump(mode="json"),
    )


def stored_job(
    blobs: BlobStore, source: MeshFile, reference: MeshFile | None = None, **fields: Any
) -> JobRecord:
    """A job that the ledger does not know yet, whose files are in the store."""
    job = make_job()

    def stored(mesh: MeshFile) -> StoredFile:
        digest = blobs.put(mesh.data, job.id)
        return StoredFile(name=mesh.name, digest=digest, size=len(mesh.data))

    files = {"source": stored(source), "reference": stored(reference or source)}
    return job.model_copy(update={**files, **fields})
