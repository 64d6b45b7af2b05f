"""Gating by a running MeshCone service: all that there is to do, as one batch."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from meshcone.errors import InternalError, MeshConeError, SolveTimeoutError
from meshcone.files import MeshFile
from meshcone.gates.results import AssetResult, AssetView, GateRun, Judgement
from meshcone.local_files import read_local
from meshcone.text import as_line
from service.api.batch_schemas import NAME_LENGTH, Batch
from service.api.request_schemas import LABEL_LENGTH, LinkedFile, NamedBlob
from service.client.connection import connect, service_errors
from service.gating.job import UNGATED, GateJob
from service.gating.pairs import Place

BATCH_TIMEOUT = 24 * 3600.0  # seconds a batch may be queued and worked on
_LOOK_INTERVAL = 0.5  # seconds

_REFUSED_PAIR = re.compile(r"pairs\[(\d+)\]: ")


class RemoteGate:
    """Sends files that are on this machine, then one batch, and waits for its verdicts.

    Raises:
        InputError: no such service answers.

    Args:
        url: where the service is.
        at_once: files that are sent at one time.
    """

    def __init__(self, url: str, at_once: int) -> None:
        """Look whether a service is there."""
        self._client = connect(url)
        self._at_once = at_once

    def run(self, jobs: Sequence[GateJob], on_result: Callable[[AssetResult], None]) -> GateRun:
        """Do all jobs and keep their order; the errors of one are part of the answer.

        ``on_result`` sees each result, those of the service when the last of its jobs has ended.
        Of a run that is interrupted, what was sent goes on.
        """
        results: dict[int, AssetResult] = {}

        def settle(index: int, result: AssetResult) -> None:
            results[index] = result
            on_result(result)

        pairs: dict[int, Mapping[str, Any]] = {}
        for index, sent in enumerate(self._each(self._sent, jobs)):
            if sent is None:
                settle(index, jobs[index].result(0.0, UNGATED))
            elif isinstance(sent, MeshConeError):
                settle(index, jobs[index].result(0.0, sent))
            else:
                pairs[index] = sent
        batch = None
        while pairs and batch is None:
            try:
                batch = self._submitted(list(pairs.values()), jobs[0].label)
            except MeshConeError as error:
                meant, words = _meant(error, list(pairs))
                for index in meant:
                    del pairs[index]
                    settle(index, jobs[index].result(0.0, words))
        if batch is not None:
            finished = self._ended(batch.id, [jobs[index] for index in pairs])
            for index, result in zip(pairs, finished, strict=True):
                settle(index, result)
        return GateRun.of([results[index] for index in range(len(jobs))], jobs[0].label)

    def _each(self, work: Callable[[Any], Any], items: Sequence[Any]) -> list[Any]:
        """What becomes of each, an error of it in its place; several are done at one time."""

        def done(item: Any) -> Any:
            try:
                with service_errors():
                    return work(item)
            except MeshConeError as error:
                return error

        threads = ThreadPoolExecutor(max_workers=max(1, min(self._at_once, len(items))))
        try:
            return list(threads.map(done, items))
        finally:  # also Ctrl-C: nothing may go on behind the caller's back
            threads.shutdown(wait=False, cancel_futures=True)

    def _sent(self, job: GateJob) -> Mapping[str, Any] | None:
        """A pair of the batch, after its files have been sent; None if there is nothing to do."""
        if not job.asks:
            return None
        name = as_line(job.pair.name)
        pair: dict[str, Any] = {
            "name": name[:NAME_LENGTH] or "asset",
            "labels": [name[:LABEL_LENGTH]],
            "options": job.options.model_dump(mode="json", exclude_defaults=True),
        }
        pair |= self._side("source", job.pair.source, job.options.cones.pin.vertices_file)
        if job.pair.reference is not None:
            pair |= self._side("reference", job.pair.reference)
        return pair

    def _side(self, side: str, place: Place, listed: str | None = None) -> Mapping[str, Any]:
        if isinstance(place, LinkedFile):
            return {side: place.model_dump(mode="json", exclude_none=True)}
        file = read_local(place, listed)
        resources = [self._uploaded(MeshFile(*each)) for each in file.resources.items()]
        return {
            side: self._uploaded(file).model_dump(),
            f"{side}_resources": [each.model_dump() for each in resources],
        }

    def _uploaded(self, file: MeshFile) -> NamedBlob:
        return self._client.upload(file)

    def _submitted(self, pairs: Sequence[Mapping[str, Any]], label: str | None) -> Batch:
        header = {} if label is None else {"name": label, "labels": [label]}
        with service_errors():
            return self._client.submit_batch(pairs, header)

    def _ended(self, batch_id: str, jobs: Sequence[GateJob]) -> list[AssetResult]:
        """What came of the jobs of a batch, in their order."""
        client = self._client
        try:
            with service_errors():
                client.wait_for_batch(batch_id, timeout=BATCH_TIMEOUT, interval=_LOOK_INTERVAL)
                found = client.batch_result(batch_id).assets
                ids = [job.id for job in client.batch_jobs(batch_id)][::-1]
        except TimeoutError as error:
            failure: MeshConeError = SolveTimeoutError(str(error))
        except MeshConeError as error:
            failure = error
        else:
            if len(found) == len(ids) == len(jobs):
                return self._each(self._result, list(zip(jobs, found, ids, strict=True)))
            failure = InternalError("jobs of the run were deleted meanwhile")
        return [job.result(0.0, failure) for job in jobs]

    def _result(self, ended: tuple[GateJob, AssetResult, str]) -> AssetResult:
        job, found, job_id = ended
        if found.error is not None:
            return job.result(found.seconds, found.error)
        if found.verdict is None:
            return job.result(found.seconds, InternalError("the service gave no verdict"))
        view = self._view(job_id) if job.viewed else None
        judgement = Judgement(found.verdict, found.warnings, view, found.statement)
        return job.result(found.seconds, judgement)

    def _view(self, job_id: str) -> AssetView:
        report = self._client.report_bytes(job_id)
        is_audit = json.loads(report)["mode"] == "audit"
        return AssetView(
            report=report.decode(),
            preview=None if is_audit else self._client.preview(job_id),
            pictures=self._client.pictures(job_id),
        )


def _meant(error: MeshConeError, indexes: Sequence[int]) -> tuple[Sequence[int], MeshConeError]:
    """Which of the pairs that were sent an error is about, the one it names or all; and it."""
    named = _REFUSED_PAIR.match(error.message)
    if named is None:
        return indexes, error
    words = type(error)(error.message[named.end() :], file=error.file)
    return [indexes[int(named[1])]], words
