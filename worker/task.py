"""What a work horse does with a job."""

from __future__ import annotations

import logging
from pathlib import PurePath

from rq.timeouts import JobTimeoutException

from meshcone.errors import LimitError, MeshConeError, SolveTimeoutError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.refine import Refinement, refine
from meshcone.report import diagnostics_csv
from meshcone.settings import load_settings
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
        refinement = refine(
            _mesh_file(blobs, record.source, record.resources),
            _mesh_file(blobs, record.reference, record.resources),
            parse_options(record.options),
            progress=ProgressReporter(ledger, job_id, attempt),
        )
        artifacts = _store_artifacts(blobs, record, refinement)
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


def _mesh_file(blobs: BlobStore, file: StoredFile, resources: tuple[StoredFile, ...]) -> MeshFile:
    return MeshFile(
        file.name,
        blobs.get(file.digest),
        {resource.name: blobs.get(resource.digest) for resource in resources},
    )


def _certificate(stem: str, refinement: Refinement) -> dict[str, tuple[bytes, str, str]]:
    if refinement.certificate is None:
        return {}
    # An .npz has no media type of its own; what it is is a ZIP archive.
    name = f"{stem}.report.certificate.npz"  # where `meshcone verify` looks beside the report
    return {"certificate": (refinement.certificate, "application/zip", name)}


def _store_artifacts(
    blobs: BlobStore, record: JobRecord, refinement: Refinement
) -> dict[str, Artifact]:
    report = refinement.report.model_dump_json().encode()
    table = diagnostics_csv(refinement.report.solver).encode()
    stem = PurePath(record.source.name).stem
    contents = {
        **_certificate(stem, refinement),
        "mesh": (refinement.data, refinement.media_type, refinement.name),
        "report": (report, "application/json", f"{stem}.report.json"),
        "diagnostics_csv": (table, "text/csv; charset=utf-8", f"{stem}.diagnostics.csv"),
    }
    return {
        name: Artifact(
            digest=blobs.put(data), media_type=media_type, filename=filename, size=len(data)
        )
        for name, (data, media_type, filename) in contents.items()
    }
