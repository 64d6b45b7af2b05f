"""What a work horse does with a job."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass

from rq.timeouts import JobTimeoutException

from meshcone.errors import LimitError, MeshConeError, SolveTimeoutError
from meshcone.files import MeshFile
from meshcone.measure import measure
from meshcone.options import parse_options
from meshcone.progress import ProgressCallback
from meshcone.refine import refine
from meshcone.settings import load_settings
from worker.artifacts import ArtifactFile, JobFiles, of_measurement, of_refinement
from worker.blob_register import BlobRegister
from worker.blobs import BlobStore
from worker.connections import connect_text
from worker.failures import TIMEOUT_MESSAGE, give_up_attempt
from worker.ledger import CancelRequestedError, Ledger, TransitionRefusedError
from worker.progress import ProgressReporter
from worker.records import Artifact, JobError, JobRecord, StoredFile
from worker.settings import WorkerSettings

logger = logging.getLogger(__name__)


def run(job_id: str) -> None:
    """Run a job of the ledger to its end.

    The sender's errors end in the ledger. An error nobody expected leaves this function,
    and is recorded by :class:`worker.failures.FailureRecorder`.
    """
    settings = load_settings(WorkerSettings)
    client = connect_text(settings.required_redis_url())
    ledger = Ledger(client)
    try:
        attempt = _begin(ledger, job_id, settings)
        results = _Results(BlobStore.open(settings), BlobRegister(client))
        _run_attempt(ledger, results, job_id, attempt)
    except TransitionRefusedError as refusal:
        # Canceled, or taken up by another worker that thought this one dead.
        logger.warning("left alone: %s", refusal)


def _begin(ledger: Ledger, job_id: str, settings: WorkerSettings) -> int:
    record = ledger.get(job_id)
    if record.state == "running":  # its worker died and nobody noted it
        give_up_attempt(ledger, record, settings.attempts)
    return ledger.begin(job_id)


def _run_attempt(ledger: Ledger, results: _Results, job_id: str, attempt: int) -> None:
    record = ledger.get(job_id)
    error: MeshConeError
    try:
        made = _work(record, results.blobs, ProgressReporter(ledger, job_id, attempt))
        artifacts = results.store(made.files)
    except CancelRequestedError:
        ledger.end_canceled(job_id, attempt)
        return
    except MeshConeError as found:
        error = found
    except JobTimeoutException:
        error = SolveTimeoutError(TIMEOUT_MESSAGE)
    except MemoryError:
        error = LimitError("the job needs more memory than this installation has")
    else:
        ledger.succeed(job_id, attempt, artifacts, verdict=made.verdict)
        return
    logger.info("job %s failed (%s): %s", job_id, error.kind, error)
    ledger.fail(job_id, attempt, JobError.of(error))


def _work(record: JobRecord, blobs: BlobStore, progress: ProgressCallback) -> JobFiles:
    options = parse_options(record.options)
    source, reference = (
        _mesh_file(blobs, file, record.resources) for file in (record.source, record.reference)
    )
    if options.mode == "measure":
        return of_measurement(record.source.name, measure(source, reference, options))
    return of_refinement(record.source.name, refine(source, reference, options, progress))


def _mesh_file(blobs: BlobStore, file: StoredFile, resources: tuple[StoredFile, ...]) -> MeshFile:
    return MeshFile(
        file.name,
        blobs.get(file.digest),
        {resource.name: blobs.get(resource.digest) for resource in resources},
    )


@dataclass(frozen=True)
class _Results:
    """Where an attempt leaves its files; nobody sees them before the ledger names them."""

    blobs: BlobStore
    register: BlobRegister

    def store(self, files: Mapping[str, ArtifactFile]) -> dict[str, Artifact]:
        self.register.lease(file.digest for file in files.values())
        return {
            name: Artifact(
                digest=self.blobs.put(file.data),
                media_type=file.media_type,
                filename=file.filename,
                size=len(file.data),
            )
            for name, file in files.items()
        }
