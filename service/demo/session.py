"""One run of the demonstration: a service of its own, one job, and its results."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from meshcone.errors import InternalError
from meshcone.files import MeshFile
from service.demo import interruption

if TYPE_CHECKING:
    from service.api.schemas import Job
    from service.client import Client
    from service.demo.display import Display
    from service.stack import Stack

LOG_NAME = "service.log"
JOB_TIMEOUT = 600.0  # seconds
_LOOK_INTERVAL = 5.0  # seconds between looks whether the service still runs


@dataclass(frozen=True)
class DemoResult:
    """What the service answered.

    Attributes:
        refined: the refined mesh, in the format of the source.
        report: ``meshcone.report/2``.
        certificate: its certificate, or None where the input was kept.
        diagnostics_csv: the solver's iterations as a table.
    """

    refined: bytes
    report: dict[str, Any]
    certificate: bytes | None
    diagnostics_csv: str


def run_session(
    source: MeshFile, reference: MeshFile, data_dir: Path, display: Display
) -> DemoResult:
    """Start a service, have it refine the pair, and end the service.

    To be called within ``interruption.interruptible()``.

    Args:
        source: the mesh to refine.
        reference: the mesh it should have been.
        data_dir: an empty directory, absolute; the service's log is in it afterwards.
        display: where progress is shown.

    Raises:
        InternalError: the service did not start, or the job did not succeed.
    """
    from service.client import Client

    with _service(data_dir, display) as stack, Client(stack.url) as client:
        display.step(f"the service listens on {stack.url}")
        job = client.submit(source, reference)
        display.step(f"sent {source.name} and {reference.name} as job {job.id}")
        job = _wait(stack, client, job.id, display)
        result = DemoResult(
            refined=client.mesh(job.id),
            report=client.report(job.id),
            certificate=client.certificate(job.id) if job.links.certificate else None,
            diagnostics_csv=client.diagnostics_csv(job.id),
        )
    interruption.allow()
    return result


@contextmanager
def _service(data_dir: Path, display: Display) -> Iterator[Stack]:
    """A running service. Nothing interrupts its start in between, and nothing its stop."""
    from service.stack import Stack
    from worker.run.stopping import StopRequest

    request = StopRequest(grace=0)
    stack = Stack(_own_settings(data_dir), log=data_dir / LOG_NAME, given_up=lambda: request.made)
    display.step("starting a broker, an API and a worker")
    try:
        with interruption.deferred(request):
            stack.start()
        yield stack
    except KeyboardInterrupt:
        interruption.ignore()
        display.step("interrupted: stopping the service")
        raise
    finally:
        interruption.ignore()
        stack.stop()


def _own_settings(data_dir: Path) -> Any:
    from worker.settings import WorkerSettings

    blobs = data_dir / "blobs"
    blobs.mkdir()
    # Stated even where it is the default, or the environment's broker and bucket were used.
    # Who interrupts the demo wants none of its results: the job in hand is not waited for.
    return WorkerSettings(redis_url=None, data_dir=data_dir, blob_url=blobs.as_uri(), stop_grace=0)


def _wait(stack: Stack, client: Client, job_id: str, display: Display) -> Job:
    deadline = time.monotonic() + JOB_TIMEOUT
    while True:
        try:
            job = client.wait(job_id, timeout=_LOOK_INTERVAL, interval=0.1, on_change=display.job)
            break
        except TimeoutError:
            stack.restart_ended()
            if time.monotonic() > deadline:
                raise InternalError(f"the job took longer than {JOB_TIMEOUT:g} s") from None
    _require_success(job)
    return job


def _require_success(job: Job) -> None:
    if job.state != "succeeded":
        reason = job.error.detail if job.error else job.state
        raise InternalError(f"the job did not succeed: {reason}")
