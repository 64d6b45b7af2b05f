"""The verdicts of a batch, put together from the reports of its jobs."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial

from anyio import to_thread

from meshcone.gates.results import AssetError, AssetResult, GateRun, Judgement
from service.api.context import Context
from service.problems import ProblemError, problem
from worker.jobs.batches import BatchRecord
from worker.jobs.records import JobFile, JobRecord, RemoteFile
from worker.storage.errors import DamagedFileError

_READ_AT_ONCE = 8  # reports; a bucket takes its time for each
_LOOKED_AT = 200  # jobs


async def write_result(
    batch: BatchRecord, context: Context, written: Callable[[GateRun], bytes]
) -> bytes:
    """The result of a batch as a document; requests for several wait for each other.

    One of ten thousand pairs takes some hundred MiB while it is written. Those that wait hold none
    of the threads that all other requests need.

    Raises:
        ProblemError: as :func:`result_of`.
    """
    return await to_thread.run_sync(
        lambda: written(result_of(batch, context)), limiter=context.result_turns
    )


def result_of(batch: BatchRecord, context: Context) -> GateRun:
    """What came of each pair of a batch that has finished, in the order in which they were sent.

    A pair that was canceled before its job was entered is an error. Of jobs that were deleted
    nothing is known; one error at the end says how many there were.

    Raises:
        ProblemError: there are none any more.
    """
    assets: list[AssetResult] = []
    with ThreadPoolExecutor(_READ_AT_ONCE) as readers:
        after = None
        while ids := context.batches.job_ids(batch.id, after, _LOOKED_AT):
            jobs = context.ledger.index.known(ids)
            kept = context.batches.judgements(batch.id, [job.id for job in jobs])
            assets += readers.map(partial(_asset, context), jobs, kept)
            after = ids[-1]
    deleted = batch.pairs - batch.dropped - len(assets)
    if deleted == batch.pairs:
        raise ProblemError(problem("gone", "the batch has no jobs any more"))
    # Jobs are entered in the order of the pairs, so that what was dropped are the last of them.
    assets += map(_dropped, range(batch.pairs - batch.dropped, batch.pairs))
    if deleted > 0:
        assets.append(_deleted(deleted, batch.pairs))
    return GateRun.of(assets, batch.name)


def _dropped(index: int) -> AssetResult:
    name = f"pairs[{index}]"  # as refusals call it: its own name went with it
    return _without_job(name, f"{name}: the batch was canceled before the job was entered")


def _deleted(count: int, pairs: int) -> AssetResult:
    words = f"of {count} of the {pairs} pairs nothing is known: their jobs were deleted"
    return _without_job("deleted pairs", words)


def _without_job(name: str, words: str) -> AssetResult:
    error = AssetError(kind="input", message=words)
    return AssetResult(name=name, source=name, reference=None, seconds=0.0, error=error)


def _asset(context: Context, job: JobRecord, kept: str | None) -> AssetResult:
    judgement, error = None, _why_none(job)
    if error is None:
        judgement = _judgement(context, job, kept)
        if judgement is None:
            error = AssetError(kind="internal", message=f"{_name(job)}: its report has expired")
    return AssetResult(
        name=_name(job),
        source=_place(job.source),
        reference=None if job.reference is None else _place(job.reference),
        seconds=0.0 if job.summary is None else job.summary.seconds,
        error=error,
        **({} if judgement is None else judgement.fields()),
    )


def _judgement(context: Context, job: JobRecord, kept: str | None) -> Judgement | None:
    if job.expired is not None:
        return None
    if kept is not None:
        return Judgement.of(json.loads(kept))
    # It was too long to be kept, or an older worker has ended the job.
    with suppress(FileNotFoundError, DamagedFileError):
        return Judgement.of(json.loads(context.blobs.get(job.artifacts["report"].digest)))
    return None


def _why_none(job: JobRecord) -> AssetError | None:
    if job.error is not None:
        return AssetError(kind=job.error.kind, message=" ".join(_words(job)))
    if job.state != "succeeded":
        return AssetError(kind="input", message=f"{_name(job)}: the job was canceled")
    return None


def _words(job: JobRecord) -> Iterator[str]:
    if job.error is not None:
        for part in (job.error.file, job.error.place):
            if part is not None:
                yield f"{part}:"
        yield job.error.message


def _name(job: JobRecord) -> str:
    return job.source.name if job.name is None else job.name


def _place(file: JobFile) -> str:
    """Where it was, without what may be a secret; the name of one that was sent."""
    if isinstance(file, RemoteFile) or file.origin is not None:
        return str(file.origin)
    return file.name
