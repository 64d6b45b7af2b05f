"""What a work horse does with a job."""

from __future__ import annotations

import logging
from collections.abc import Mapping

from rq.timeouts import JobTimeoutException

from meshcone.errors import LimitError, MeshConeError, SolveTimeoutError
from meshcone.files import MeshFile
from meshcone.measure import measure
from meshcone.options import parse_options
from meshcone.progress import ProgressCallback
from meshcone.refine import refine
from meshcone.settings import load_settings
from worker.artifacts import ArtifactFile, of_measurement, of_refinement
from worker.blobs import BlobStore
from worker.connections import connect_text
from worker.failures import TIMEOUT_MESSAGE, give_up_attempt
from worker.ledger import Ledger, TransitionRefusedError
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
    ledger = Ledger(connect_text(settings.required_redis_url()))
    try:
        attempt = _begin(ledger, job_id, settings)
        _run_attempt(ledger, BlobStore.open(settings), job_id, attempt)
    except TransitionRefusedError as refusal:
        # Canceled, or taken up by another worker that thought this one dead.
        logger.warning("left alone: %s", refusal)


def _begin(ledger: Ledger, job_id: str, settings: WorkerSettings) -> int:
    record = ledger.get(job_id)
    if record.state == "running":  # its worker died and nobody noted it
        give_up_attempt(ledger, record, settings.attempts)
    return ledger.begin(job_id)


def _run_attempt(ledger: Ledger, blobs: BlobStore, job_id: str, attempt: int) -> None:
    record = ledger.get(job_id)
    error: MeshConeError
    try:
        files = _work(record, blobs, ProgressReporter(ledger, job_id, attempt))
        artifacts = _stored(blobs, files)
    except MeshConeError as found:
        error = found
    except JobTimeoutException:
        error = SolveTimeoutError(TIMEOUT_MESSAGE)
    except MemoryError:
        error = LimitError("the job needs more memory than this installation has")
    else:
        ledger.succeed(job_id, attempt, artifacts)
        return
    logger.info("job %s failed (%s): %s", job_id, error.kind, error)
    ledger.fail(job_id, attempt, JobError.of(error))


def _work(
    record: JobRecord, blobs: BlobStore, progress: ProgressCallback
) -> dict[str, ArtifactFile]:
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


def _stored(blobs: BlobStore, files: Mapping[str, ArtifactFile]) -> dict[str, Artifact]:
    return {
        name: Artifact(
            digest=blobs.put(file.data),
            media_type=file.media_type,
            filename=file.filename,
            size=len(file.data),
        )
        for name, file in files.items()
    }
