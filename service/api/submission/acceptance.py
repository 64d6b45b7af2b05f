"""From a sound form to a queued job."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

import structlog
from redis.exceptions import RedisError
from starlette.concurrency import run_in_threadpool

from meshcone.errors import InputError
from service.api.checking.checks import MeshFiles
from service.api.context import Context
from service.api.request_schemas import NamedBlob
from service.api.submission.parts import AnyFile, SubmittedForm, Upload
from service.api.submission.submission import IncomingFile, Submission, gathered
from service.problems import ProblemError, key_reused, problem, queue_full
from worker.jobs.errors import KeyReusedError, QueueFullError, UnknownJobError
from worker.jobs.idempotency import BoundKey, Claim
from worker.jobs.identifiers import new_job_id
from worker.jobs.records import JobRecord, RemoteFile, StoredFile
from worker.storage.blobs import digest_of
from worker.storage.errors import DamagedFileError

if TYPE_CHECKING:
    from service.api.sender import Sender

logger = structlog.get_logger(__name__)

KEY_REMEMBERED = 86_400  # seconds; a client that repeats itself later has forgotten why


def gather(form: SubmittedForm, sender: Sender, context: Context) -> Submission:
    """Find every file of a submission, and keep those that are stored from vanishing.

    Raises:
        InputError: a file that is named was not sent before by the sender's project, or is no
            longer there.
    """
    job_id = new_job_id()
    return gathered(form, job_id, lambda file: _incoming(file, job_id, sender, context))


def size_of_blob(file: NamedBlob, holder: str, sender: Sender, context: Context) -> int:
    """Bytes of a file that was sent before, which is kept for a holder from now on.

    Raises:
        InputError: the sender's project has not sent it, or it is no longer there.
    """
    unknown = InputError(
        f"there is no file with the SHA-256 {file.sha256}; send it first, "
        f"by PUT /v1/blobs/{file.sha256}",
        file=file.name,
    )
    if not context.register.is_had(file.sha256, sender.view):
        raise unknown
    # Leased before it is looked for: what is found then stays.
    context.register.lease({file.sha256}, holder)
    try:
        return context.blobs.size(file.sha256)
    except (FileNotFoundError, DamagedFileError):
        raise unknown from None


def require_signable(webhook: str | None, sender: Sender, context: Context) -> None:
    """Refuse a webhook that could not be signed.

    Raises:
        InputError: neither the sender nor the installation has a secret for it.
    """
    has_secret = sender.key is not None or context.settings.webhook_secret is not None
    if webhook is not None and not has_secret:
        raise InputError(
            "there is nothing to sign the webhook with: send the job with an API key, "
            "or have MESHCONE_WEBHOOK_SECRET set"
        )


async def check_meshes(submission: Submission, context: Context) -> None:
    """Have both meshes read, so that a file nobody could work on is refused before any is kept.

    Raises:
        InputError: a file is no mesh, or names a resource that was not sent.
        LimitError: a file is larger than can be worked on.
        ProblemError: there is no time for it just now.
    """
    with ExitStack() as stack:

        def opened(mesh: IncomingFile, own: tuple[IncomingFile, ...]) -> MeshFiles:
            files = {
                file.file.name: stack.enter_context(file.opened(context.blobs))
                for file in (*submission.resources, *own)
            }
            data = stack.enter_context(mesh.opened(context.blobs))
            return MeshFiles(mesh.file.name, data, files)

        source = await run_in_threadpool(opened, submission.source, submission.source_resources)
        reference = None
        if submission.reference is not None:
            reference = await run_in_threadpool(
                opened, submission.reference, submission.reference_resources
            )
        await context.checks.check(source, reference, submission.options)


def made_before(submission: Submission, claim: Claim, context: Context) -> JobRecord | None:
    """The job that the same request has made before, if it has.

    Raises:
        ProblemError: another request has used its key, or the job is there no more.
    """
    if claim.job_id is None:
        return None
    if claim.fingerprint != submission.fingerprint():
        raise key_reused()
    return _known(claim.job_id, context)


def with_accounts(record: JobRecord, sender: Sender, context: Context) -> JobRecord:
    """The record of a job; if files are to be fetched for it, with whom their bytes count for."""
    if sender.key is None or len(record.stored_files) == len(record.files):
        return record
    return record.model_copy(update={"fetch_accounts": context.quotas.byte_accounts(sender.key)})


def accept(
    submission: Submission, claim: Claim | None, sender: Sender, context: Context
) -> JobRecord:
    """Store the files, enter the job in the ledger and queue it, in this order.

    Whatever fails on the way, no job is known whose files are missing, and none is queued
    that is not known. Once it is known, workers see to it that it is queued.

    Raises:
        ProblemError: the queue is full, the sender's quota is used up, or another request
            has used the key.
    """
    record = with_accounts(submission.record(sender), sender, context)
    if sender.key is None:
        return _enter(record, submission, claim, sender, context)
    context.quotas.reserve(sender.key, record.id, submission.size)
    try:
        return _enter(record, submission, claim, sender, context)
    finally:
        context.quotas.settle(sender.key, record.id, submission.size)


@contextmanager
def refusals() -> Iterator[None]:
    """Answer with a problem where the ledger lets nothing in.

    Raises:
        ProblemError: the queue is full, or the key belongs to another request.
    """
    try:
        yield
    except QueueFullError:
        raise queue_full() from None
    except KeyReusedError:
        raise key_reused() from None


def _enter(
    record: JobRecord,
    submission: Submission,
    claim: Claim | None,
    sender: Sender,
    context: Context,
) -> JobRecord:
    context.register.lease({file.digest for file in record.stored_files}, record.id)
    uploads = {
        each.file.digest: each.upload.file
        for each in submission.files
        if each.upload is not None and isinstance(each.file, StoredFile)
    }
    new = {digest for digest in uploads if not context.register.is_had(digest, sender.view)}
    context.blobs.put_files(uploads, anew=new)
    key = None
    if claim is not None:
        key = BoundKey(claim.place, submission.fingerprint(), KEY_REMEMBERED)
    with refusals():
        job_id = context.ledger.create(record, capacity=context.settings.queue_capacity, key=key)
    if job_id != record.id:
        return _known(job_id, context)
    if not submission.is_complete:
        logger.info("job accepted, its files to be fetched", job_id=record.id)
        return record
    try:
        context.queue.enqueue(record.id)
    except RedisError as error:
        # It is known, so it is accepted; a client that is told otherwise would send it again.
        logger.warning("job accepted, its message not sent", job_id=record.id, reason=str(error))
    else:
        logger.info("job accepted", job_id=record.id)
    return record


def _incoming(file: AnyFile, job_id: str, sender: Sender, context: Context) -> IncomingFile:
    if isinstance(file, RemoteFile):
        return IncomingFile(file)
    if isinstance(file, Upload):
        stored = StoredFile(name=file.name, digest=digest_of(file.file), size=file.size)
        return IncomingFile(stored, file)
    size = size_of_blob(file, job_id, sender, context)
    return IncomingFile(StoredFile(name=file.name, digest=file.sha256, size=size))


def _known(job_id: str, context: Context) -> JobRecord:
    try:
        return context.ledger.get(job_id)
    except UnknownJobError:
        raise ProblemError(
            problem("gone", "the job that this Idempotency-Key has made has been deleted")
        ) from None
