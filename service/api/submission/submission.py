"""From a sound form to a queued job."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, Any

import structlog
from redis.exceptions import RedisError
from starlette.concurrency import run_in_threadpool

from meshcone.errors import InputError
from meshcone.options import OPTIONS_VERSION, Options
from service.api.checking.checks import MeshFiles
from service.api.context import Context
from service.api.request_schemas import NamedBlob
from service.api.submission.parts import AnyFile, SubmittedForm, Upload
from service.problems import ProblemError, problem, queue_full
from worker.jobs.errors import KeyReusedError, QueueFullError, UnknownJobError
from worker.jobs.idempotency import BoundKey, Claim
from worker.jobs.identifiers import new_job_id
from worker.jobs.records import (
    JobFile,
    JobProgress,
    JobRecord,
    Output,
    OutputName,
    RemoteFile,
    StoredFile,
)
from worker.storage.blobs import BlobStore, digest_of
from worker.storage.errors import DamagedFileError

if TYPE_CHECKING:
    from service.api.sender import Sender

logger = structlog.get_logger(__name__)

KEY_REMEMBERED = 86_400  # seconds; a client that repeats itself later has forgotten why


@dataclass(frozen=True)
class IncomingFile:
    """A file of a submission, wherever its bytes are now.

    Attributes:
        file: what the job's record will say of it.
        upload: its bytes, if this request has brought them.
    """

    file: JobFile
    upload: Upload | None = None

    @property
    def size(self) -> int:
        """Bytes; none are known of what is still to be fetched."""
        return self.file.size if isinstance(self.file, StoredFile) else 0

    def identity(self) -> tuple[str | None, ...]:
        """What tells it from other files, in a request that may be repeated."""
        if isinstance(self.file, StoredFile):
            return self.file.name, self.file.digest
        return tuple(self.file.model_dump().values())

    @contextmanager
    def opened(self, blobs: BlobStore) -> Iterator[IO[bytes]]:
        """The file itself, or a copy of the blob.

        Raises:
            FileNotFoundError: it has still to be fetched.
        """
        if self.upload is not None:
            yield self.upload.file
            return
        if isinstance(self.file, RemoteFile):
            raise FileNotFoundError(self.file.name)
        with TemporaryFile() as copy:
            copy.writelines(blobs.chunks(self.file.digest))
            yield copy


@dataclass(frozen=True)
class Submission:
    """A submission whose files are known by their digests, and the id its job will have."""

    job_id: str
    source: IncomingFile
    reference: IncomingFile | None
    source_resources: tuple[IncomingFile, ...]
    reference_resources: tuple[IncomingFile, ...]
    resources: tuple[IncomingFile, ...]
    options: Options
    options_as_sent: dict[str, Any]
    labels: tuple[str, ...]
    webhook: str | None
    outputs: Mapping[OutputName, Output]

    @property
    def files(self) -> tuple[IncomingFile, ...]:
        """All of them."""
        beside = self.source_resources + self.reference_resources + self.resources
        return (*self.meshes, *beside)

    @property
    def meshes(self) -> tuple[IncomingFile, ...]:
        """The source, and the reference if there is one."""
        return (self.source,) if self.reference is None else (self.source, self.reference)

    @property
    def size(self) -> int:
        """Bytes of all files together, as far as they are known."""
        return sum(file.size for file in self.files)

    @property
    def is_complete(self) -> bool:
        """Whether none of its files has still to be fetched."""
        return not any(isinstance(each.file, RemoteFile) for each in self.files)

    def record(self, sender: Sender) -> JobRecord:
        """The job that the ledger is to know."""
        return JobRecord(
            id=self.job_id,
            created=datetime.now(UTC),
            labels=self.labels,
            source=self.source.file,
            reference=self.reference and self.reference.file,
            source_resources=tuple(each.file for each in self.source_resources),
            reference_resources=tuple(each.file for each in self.reference_resources),
            resources=tuple(each.file for each in self.resources),
            progress=None if self.is_complete else JobProgress.fetching(),
            mode=self.options.mode,
            options=self.options_as_sent,
            options_version=OPTIONS_VERSION,
            webhook=self.webhook,
            outputs=dict(self.outputs),
            owner=sender.owner,
            project=sender.project,
            context=sender.context,
        )

    def fingerprint(self) -> str:
        """A digest that is the same for the same request, and for no other."""
        document: dict[str, Any] = {
            "files": _identities((*self.meshes, *self.resources)),
            # Without defaults: a program that knows one more option makes no other request of it.
            "options": self.options.model_dump(mode="json", exclude_defaults=True),
            "labels": self.labels,
            "webhook": self.webhook,
        }
        if self.outputs:
            document["outputs"] = {name: _place(each) for name, each in self.outputs.items()}
        if self.reference is None:
            document["alone"] = True
        # Left out where empty: a key that was bound before there were sides still fits.
        if self.source_resources:
            document["source_resources"] = _identities(self.source_resources)
        if self.reference_resources:
            document["reference_resources"] = _identities(self.reference_resources)
        return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()


def gather(form: SubmittedForm, sender: Sender, context: Context) -> Submission:
    """Find every file of a submission, and keep those that are stored from vanishing.

    Raises:
        InputError: a file that is named was not sent before by the sender's project, or is no
            longer there.
    """
    job_id = new_job_id()
    return gathered(form, job_id, lambda file: _incoming(file, job_id, sender, context))


def gathered(
    form: SubmittedForm, job_id: str, found: Callable[[AnyFile], IncomingFile]
) -> Submission:
    """A submission whose files are what ``found`` says; what that raises is raised."""
    return Submission(
        job_id=job_id,
        source=found(form.source),
        reference=None if form.reference is None else found(form.reference),
        source_resources=tuple(map(found, form.source_resources)),
        reference_resources=tuple(map(found, form.reference_resources)),
        resources=tuple(map(found, form.resources)),
        options=form.options,
        options_as_sent=form.options_as_sent,
        labels=form.labels,
        webhook=form.webhook,
        outputs=form.outputs,
    )


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
    try:
        job_id = context.ledger.create(record, capacity=context.settings.queue_capacity, key=key)
    except QueueFullError:
        raise queue_full() from None
    except KeyReusedError:
        raise key_reused() from None
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


def _place(output: Output) -> str | list[str]:
    # The URL alone where no secret is shown there, as a key was bound before secrets counted.
    return output.url if output.authorization is None else [output.url, output.authorization]


def _identities(files: tuple[IncomingFile, ...]) -> list[tuple[str | None, ...]]:
    return [file.identity() for file in files]


def _incoming(file: AnyFile, job_id: str, sender: Sender, context: Context) -> IncomingFile:
    if isinstance(file, RemoteFile):
        return IncomingFile(file)
    if isinstance(file, Upload):
        stored = StoredFile(name=file.name, digest=digest_of(file.file), size=file.size)
        return IncomingFile(stored, file)
    size = size_of_blob(file, job_id, sender, context)
    return IncomingFile(StoredFile(name=file.name, digest=file.sha256, size=size))


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


def _known(job_id: str, context: Context) -> JobRecord:
    try:
        return context.ledger.get(job_id)
    except UnknownJobError:
        raise ProblemError(
            problem("gone", "the job that this Idempotency-Key has made has been deleted")
        ) from None


def key_reused() -> ProblemError:
    """What to raise where a key belongs to another request."""
    return ProblemError(
        problem("key-reused", "this Idempotency-Key belongs to a request with other content")
    )
