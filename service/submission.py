"""From a sound form to a queued job."""

from __future__ import annotations

from datetime import UTC, datetime

from meshcone.assets import read_asset
from service.context import Context
from service.uploads import Submission, Upload
from worker.blobs import BlobStore
from worker.identifiers import new_job_id
from worker.records import JobRecord, StoredFile


def check_meshes(submission: Submission) -> None:
    """Read both meshes, so that a file nobody could work on is refused before anything is kept.

    Raises:
        InputError: a file is no mesh, or names a resource that was not sent.
        LimitError: a file is larger than can be worked on.
    """
    resources = {resource.name: resource.read() for resource in submission.resources}
    source, _reference = (
        read_asset(upload.name, upload.read(), resources)
        for upload in (submission.source, submission.reference)
    )
    if submission.options.mode == "refine":
        source.ensure_writable(source.policy(submission.options))


def accept(submission: Submission, context: Context) -> JobRecord:
    """Store the files, enter the job in the ledger and queue it, in this order.

    Whatever fails on the way, no job is known whose files are missing, and none is queued
    that is not known.
    """
    record = JobRecord(
        id=new_job_id(),
        created=datetime.now(UTC),
        labels=() if submission.label is None else (submission.label,),
        source=_stored(context.blobs, submission.source),
        reference=_stored(context.blobs, submission.reference),
        resources=tuple(_stored(context.blobs, upload) for upload in submission.resources),
        options=submission.options.model_dump(mode="json"),
    )
    context.ledger.create(record)
    context.queue.enqueue(record.id)
    return record


def _stored(blobs: BlobStore, upload: Upload) -> StoredFile:
    return StoredFile(name=upload.name, digest=blobs.put_file(upload.file), size=upload.size)
