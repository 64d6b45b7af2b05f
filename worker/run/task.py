"""What a work horse does with a job."""

from __future__ import annotations

import logging
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import structlog
from redis.exceptions import RedisError

from meshcone.errors import (
    InternalError,
    LimitError,
    MeshConeError,
    OutOfMemoryError,
    SolveTimeoutError,
)
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.progress import ProgressCallback
from meshcone.settings import load_settings
from meshcone.verbs.audit import examination
from meshcone.verbs.measure import measurement
from meshcone.verbs.within import refine_within
from worker.broker.connections import connect_text
from worker.broker.patience import patiently
from worker.jobs.errors import CancelRequestedError, TransitionRefusedError, UnknownJobError
from worker.jobs.ledger import Ledger
from worker.jobs.records import Artifact, JobError, JobFile, JobRecord, JobState, RemoteFile
from worker.run.artifacts import ArtifactFile, JobFiles, of_audit, of_measurement, of_refinement
from worker.run.progress import ProgressReporter
from worker.run.sandbox import confine
from worker.run.settlement import DISK_FULL, MEMORY_MESSAGE, TIMEOUT_MESSAGE
from worker.run.time_limit import TimeLimitReached, time_limit
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.errors import FULL_DISK, DamagedFileError, StoreError, StoreFullError
from worker.storage.register import BlobRegister

logger = logging.getLogger(__name__)

_OWN_SHARE = 0.5  # of a disk; if that is free without the job's files, it was they that filled it
SOLVER_SHARE = 0.9  # of the job's time, which one solve may take at most


def run(job_id: str, attempt: int) -> int:
    """Run an attempt of a job to its end, in a process of its own.

    Returns:
        An exit code: ``EX_OK`` if the ledger has been told, or knows better;
        ``EX_TEMPFAIL`` if broker or file store failed, which may be worth another attempt;
        ``DISK_FULL`` if its files find no room, which is no fault of the job.
    """
    settings = load_settings(WorkerSettings)
    confine(settings)
    client = connect_text(settings.required_redis_url())
    ledger = Ledger(client)
    try:
        record = patiently(partial(ledger.get, job_id))
        structlog.contextvars.bind_contextvars(request_id=record.context.get("request_id"))
        blobs = BlobStore.open(settings, BlobRegister(client, when_full=True))
        results = _Results(job_id, blobs)
        report = ProgressReporter(ledger, job_id, attempt)
        patiently(_last_step(ledger, record, attempt, _Job(settings, record, results, report)))
    except (TransitionRefusedError, UnknownJobError) as refusal:
        # Canceled, or taken up by another worker that thought this one dead.
        logger.warning("left alone: %s", refusal)
    except (StoreFullError, DiskFullError):
        return DISK_FULL
    except (RedisError, StoreError):
        logger.exception("broker or file store failed under job %s", job_id)
        return os.EX_TEMPFAIL
    return os.EX_OK


@dataclass(frozen=True)
class _Job:
    settings: WorkerSettings
    record: JobRecord
    results: _Results
    progress: ProgressCallback

    def done(self) -> tuple[dict[str, Artifact], JobFiles]:
        """Do the work and store its files, within the time limit."""
        with time_limit(self.settings.job_timeout):
            made = _work(self.record, self.results.blobs, self.progress, self.settings.job_timeout)
            _require_small(made.files, self.settings.job_file_bytes)
            return self.results.store(made.files), made


def _last_step(
    ledger: Ledger, record: JobRecord, attempt: int, job: _Job
) -> Callable[[], JobState | None]:
    """Do a job; what is to be told to the ledger about it."""
    error: MeshConeError
    try:
        artifacts, made = job.done()
    except (RedisError, StoreError, TransitionRefusedError, UnknownJobError):
        raise
    except CancelRequestedError:
        return partial(ledger.end_canceled, record.id, attempt)
    except MeshConeError as found:
        error = found
    except TimeLimitReached:
        error = SolveTimeoutError(TIMEOUT_MESSAGE)
    except MemoryError:
        error = OutOfMemoryError(f"{MEMORY_MESSAGE} (MESHCONE_JOB_MEMORY_BYTES)")
    except Exception as found:  # as a rule a fault of ours; another attempt would only repeat it
        logger.exception("job %s failed unexpectedly", record.id)
        if getattr(found, "errno", None) in FULL_DISK:
            error = full_disk()
        else:
            error = InternalError("an unexpected error in the service; it has been logged")
    else:
        return partial(
            ledger.succeed,
            record.id,
            attempt,
            artifacts,
            verdict=made.verdict,
            summary=made.summary,
            judgement=None if record.batch is None else made.judgement,
            timings=made.tallies.timings,
            counters=made.tallies.counters,
        )
    logger.info("job %s failed (%s): %s", record.id, error.kind, error)
    return partial(ledger.fail, record.id, attempt, JobError.of(error))


class DiskFullError(Exception):
    """Others' files fill the disk of temporary files."""


def full_disk() -> LimitError:
    """What to say of a job that filled a disk, whose files are removed by now.

    Raises:
        DiskFullError: others fill it, so that the job may find room at another time.
    """
    disk = shutil.disk_usage(tempfile.gettempdir())
    if disk.free < _OWN_SHARE * disk.total:
        raise DiskFullError
    return LimitError(
        f"the job's temporary files take more than the {disk.free:,} bytes that the disk of "
        "its worker has for them (TMPDIR)"
    )


def _require_small(files: Mapping[str, ArtifactFile], limit: int) -> None:
    for file in files.values():
        if 0 < limit < len(file.data):
            raise LimitError(
                f"the result '{file.filename}' has {len(file.data)} bytes; this installation "
                f"stores up to {limit} (MESHCONE_JOB_FILE_BYTES)"
            )


def _work(
    record: JobRecord, blobs: BlobStore, progress: ProgressCallback, seconds: int
) -> JobFiles:
    options = parse_options(record.options)
    source = _mesh_file(blobs, record.source, record.source_resources + record.resources)
    reference = None
    if record.reference is not None:
        beside = record.reference_resources + record.resources
        reference = _mesh_file(blobs, record.reference, beside)
    if options.mode == "audit":
        return of_audit(record.source.name, examination(source, reference, options))
    if reference is None:
        raise InternalError("the job has no reference")
    if options.mode == "measure":
        return of_measurement(record.source.name, measurement(source, reference, options))
    # Below the job's own limit, so that the solver's C code returns before the alarm.
    limit = SOLVER_SHARE * seconds
    made = refine_within(source, reference, options, progress, solve_seconds=limit)
    return of_refinement(record.source.name, made)


def _mesh_file(blobs: BlobStore, file: JobFile, resources: tuple[JobFile, ...]) -> MeshFile:
    return MeshFile(
        file.name,
        _content(blobs, file),
        {resource.name: _content(blobs, resource) for resource in resources},
    )


def _content(blobs: BlobStore, file: JobFile) -> bytes:
    if isinstance(file, RemoteFile):
        raise InternalError("the file has not been fetched", file=file.name)
    try:
        return blobs.get(file.digest)
    except DamagedFileError as error:  # another attempt would find the same
        raise InternalError(str(error), file=file.name) from None


@dataclass(frozen=True)
class _Results:
    """Where an attempt leaves its files; nobody sees them before the ledger names them."""

    job_id: str
    blobs: BlobStore

    def store(self, files: Mapping[str, ArtifactFile]) -> dict[str, Artifact]:
        digests = self.blobs.put_all([file.data for file in files.values()], self.job_id)
        return {
            name: Artifact(
                digest=digest,
                media_type=file.media_type,
                filename=file.filename,
                size=len(file.data),
            )
            for digest, (name, file) in zip(digests, files.items(), strict=True)
        }
