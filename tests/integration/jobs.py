"""Ledger entries that no file stands behind."""

from __future__ import annotations

from datetime import UTC, datetime

from meshcone.options import Options
from worker.jobs.identifiers import new_job_id
from worker.jobs.records import JobRecord, StoredFile


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
