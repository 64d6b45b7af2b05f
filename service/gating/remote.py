"""Gating by a running MeshCone service."""

from __future__ import annotations

import json
import threading
from typing import Any

import httpx2

from meshcone.errors import InternalError, SolveTimeoutError
from meshcone.files import MeshFile
from meshcone.gates.results import AssetResult, AssetView
from meshcone.local_files import read_local
from service.api.schemas import LABEL_LENGTH, LinkedFile
from service.client import ServiceError
from service.client.connection import connect, error_of
from service.gating.job import GateJob, Judgement, judged
from service.gating.pairs import Place

JOB_TIMEOUT = 3600.0  # seconds a job may be queued and worked on
_LOOK_INTERVAL = 1.0  # seconds between looks whether to go on waiting


class RemoteGatekeeper:
    """Sends every job to a service and waits for its report.

    Raises:
        InputError: no such service answers.
    """

    def __init__(self, url: str) -> None:
        """Look whether a service is there."""
        self._client = connect(url)
        self._stopped = threading.Event()

    def judge(self, job: GateJob) -> AssetResult:
        """Do a job; its errors are part of the answer."""
        return judged(job, self._work)

    def stop(self) -> None:
        """Wait for no more jobs; those that were sent go on."""
        self._stopped.set()

    def _work(self, job: GateJob) -> Judgement:
        try:
            return self._judgement(job)
        except ServiceError as error:
            raise error_of(error.problem) from None
        except httpx2.HTTPError as error:
            raise InternalError(f"the service does not answer: {error}") from None

    def _judgement(self, job: GateJob) -> Judgement:
        source = _file(job.pair.source, job.options.cones.pin.vertices_file)
        reference = None if job.pair.reference is None else _file(job.pair.reference)
        document = job.options.model_dump(mode="json", exclude_defaults=True)
        name = "".join(each for each in job.pair.name if each.isprintable())[:LABEL_LENGTH]
        labels = [name] if job.label is None else [job.label, name]
        sent = self._client.submit(source, reference, document, labels=labels)
        waited = 0.0
        while not self._stopped.is_set() and waited < JOB_TIMEOUT:
            try:
                ended = self._client.wait(sent.id, timeout=_LOOK_INTERVAL)
            except TimeoutError:
                waited += _LOOK_INTERVAL
                continue
            if ended.error is not None:
                raise error_of(ended.error)
            report = self._client.report(ended.id)
            return Judgement.of(report, self._view(ended.id, report) if job.viewed else None)
        raise SolveTimeoutError(f"job {sent.id} has not ended within {JOB_TIMEOUT:g} s")

    def _view(self, job_id: str, report: dict[str, Any]) -> AssetView:
        return AssetView(
            report=json.dumps(report),
            preview=None if report["mode"] == "audit" else self._client.preview(job_id),
            pictures=self._client.pictures(job_id),
        )


def _file(place: Place, listed: str | None = None) -> MeshFile | LinkedFile:
    return place if isinstance(place, LinkedFile) else read_local(place, listed)
