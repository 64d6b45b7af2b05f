"""From a batch's document to an accepted batch."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Iterator
from contextlib import suppress
from datetime import UTC, datetime
from tempfile import SpooledTemporaryFile
from typing import IO, TYPE_CHECKING

import structlog
from fastapi import Request
from redis.exceptions import RedisError

from meshcone.errors import InputError, LimitError
from service.api.context import Context
from service.api.request_schemas import NamedBlob
from service.api.submission.acceptance import (
    KEY_REMEMBERED,
    refusals,
    require_signable,
    size_of_blob,
    with_accounts,
)
from service.api.submission.batch_document import BatchDocument, naming_pair
from service.api.submission.parts import AnyFile, labels_of, webhook_of
from service.api.submission.submission import IncomingFile, gathered
from service.problems import ProblemError, key_reused, problem, queue_full
from service.settings import ServiceSettings
from worker.jobs.batches import BatchRecord
from worker.jobs.errors import StagedJobsLostError, UnknownBatchError
from worker.jobs.idempotency import BoundKey, Claim
from worker.jobs.identifiers import ids_in_order, new_job_id
from worker.jobs.records import JobRecord, RemoteFile, StoredFile

if TYPE_CHECKING:
    from service.api.sender import Sender

logger = structlog.get_logger(__name__)

_IN_MEMORY = 1024 * 1024  # bytes of a document; the rest of it is on disk
_STAGED_AT_ONCE = 100  # jobs
_STAGED_BYTES = 2  # of all jobs together, each with the options of all, as times batch_bytes


async def read_batch(request: Request) -> AsyncIterator[IO[bytes]]:
    """The request's content, as a dependency: a file that goes with the request.

    Raises:
        ProblemError: it is no JSON.
        LimitError: it is too long.
    """
    content_type = request.headers.get("content-type", "")
    if content_type.partition(";")[0].strip().lower() != "application/json":
        raise ProblemError(problem("media-type", "send a batch as application/json"))
    settings: ServiceSettings = request.app.state.settings
    with SpooledTemporaryFile(_IN_MEMORY) as file:
        async for chunk in request.stream():
            file.write(chunk)
            if file.tell() > settings.batch_bytes:
                raise LimitError(
                    f"the batch is longer than the {settings.batch_bytes} bytes accepted here "
                    "(MESHCONE_BATCH_BYTES)"
                )
        yield file


def accept_batch(
    file: IO[bytes], claim: Claim | None, sender: Sender, context: Context
) -> BatchRecord:
    """Stage every job of a batch, then accept it; its jobs have still to be entered.

    Whatever fails on the way, nothing of it is known. Once it is accepted, workers see to it that
    all of its jobs are entered.

    Raises:
        InputError: it is no batch, or a pair of it cannot be used.
        LimitError: it has too much of something.
        ProblemError: the queue has no room for it, the sender's quota is used up, or another
            request has used the key.
    """
    document = BatchDocument(file, context.settings)
    if claim is not None and claim.job_id is not None:
        if claim.fingerprint != document.fingerprint:
            raise key_reused()
        return _known(claim.job_id, context)
    header = document.header
    batch = BatchRecord(
        id=new_job_id(),
        created=datetime.now(UTC),
        name=header.name,
        labels=labels_of(header.labels),
        pairs=document.count,
        webhook=webhook_of(header.webhook, context.settings),
        owner=sender.owner,
        project=sender.project,
        accounts=() if sender.key is None else context.quotas.places(sender.key),
    )
    require_signable(batch.webhook, sender, context)
    if not context.ledger.index.has_room(
        context.settings.queue_capacity, sender.project, sender.owner, batch.pairs
    ):
        raise queue_full()
    if sender.key is not None:
        # The bytes are known only of staged jobs; so many jobs are refused before any is staged.
        context.quotas.reserve(sender.key, batch.id, 0, batch.pairs)
        context.quotas.settle(sender.key, batch.id, 0)
    try:
        return _commit(batch, document, claim, sender, context)
    finally:
        with suppress(RedisError):  # it goes by itself, and what is accepted stays so
            context.batches.unstage(batch.id)


def _commit(
    batch: BatchRecord,
    document: BatchDocument,
    claim: Claim | None,
    sender: Sender,
    context: Context,
) -> BatchRecord:
    size, left, staged = 0, _STAGED_BYTES * context.settings.batch_bytes, list[JobRecord]()
    for job in _jobs(batch, document, sender, context):
        left -= len(json.dumps(job.entry()))
        if left < 0:
            raise _too_long(context.settings)
        size += sum(file.size for file in job.stored_files)
        staged.append(job)
        if len(staged) == _STAGED_AT_ONCE:
            context.batches.stage(batch.id, staged)
            staged = []
    if staged:
        context.batches.stage(batch.id, staged)
    if sender.key is not None:
        context.quotas.reserve(sender.key, batch.id, size, batch.pairs)
    key = None
    if claim is not None:
        key = BoundKey(claim.place, document.fingerprint, KEY_REMEMBERED)
    try:
        with refusals():
            found = context.batches.commit(batch, capacity=context.settings.queue_capacity, key=key)
    except StagedJobsLostError:
        raise ProblemError(
            problem("unavailable", "the batch could not be taken in fast enough; send it again"),
            {"Retry-After": str(context.settings.retry_after)},
        ) from None
    finally:
        if sender.key is not None:
            context.quotas.settle(sender.key, batch.id, size)
    if found != batch.id:
        return _known(found, context)
    logger.info("batch accepted", batch_id=batch.id, pairs=batch.pairs)
    return batch


def _jobs(
    batch: BatchRecord, document: BatchDocument, sender: Sender, context: Context
) -> Iterator[JobRecord]:
    files = _Files(batch.id, sender, context)
    pairs = zip(ids_in_order(), document.pairs(), strict=False)
    for index, (job_id, (name, form)) in enumerate(pairs):
        with naming_pair(index):
            require_signable(form.webhook, sender, context)
            record = gathered(form, job_id, files.found).record(sender)
            record = with_accounts(record, sender, context)
        yield record.model_copy(
            update={"batch": batch.id, "name": record.source.name if name is None else name}
        )


class _Files:
    """The files that a batch names, each looked for once however many pairs name it."""

    def __init__(self, batch_id: str, sender: Sender, context: Context) -> None:
        self._batch_id = batch_id
        self._sender = sender
        self._context = context
        self._sizes: dict[str, int] = {}

    def found(self, file: AnyFile) -> IncomingFile:
        if isinstance(file, RemoteFile):
            return IncomingFile(file)
        if not isinstance(file, NamedBlob):
            raise InputError("a batch carries no files: name each by its URL or its hash")
        size = self._sizes.get(file.sha256)
        if size is None:
            # Kept in the batch's name, as its jobs are not known yet.
            size = size_of_blob(file, self._batch_id, self._sender, self._context)
            self._sizes[file.sha256] = size
        return IncomingFile(StoredFile(name=file.name, digest=file.sha256, size=size))


def _too_long(settings: ServiceSettings) -> LimitError:
    return LimitError(
        "the jobs of the batch, each with the options of all, have more than the "
        f"{_STAGED_BYTES * settings.batch_bytes} bytes together that are accepted here, "
        f"{_STAGED_BYTES} times MESHCONE_BATCH_BYTES: send fewer pairs at once, and a long list "
        "of pinned vertices as a file that cones.pin.vertices_file names"
    )


def _known(batch_id: str, context: Context) -> BatchRecord:
    try:
        return context.batches.get(batch_id)
    except UnknownBatchError:
        raise ProblemError(
            problem("gone", "the batch that this Idempotency-Key has made has been deleted")
        ) from None
