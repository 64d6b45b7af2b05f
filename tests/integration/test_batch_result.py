"""The verdict of a batch, put together from what its jobs have left with it."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path

import pytest

from meshcone.files import MeshFile
from meshcone.gates.results import GateRun
from meshcone.options import parse_options
from meshcone.verbs.measure import measurement
from service.api.batch_results import result_of
from service.api.context import Context, open_context
from service.problems import ProblemError
from service.settings import ServiceSettings
from tests import shapes
from tests.integration.jobs import make_job
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.batches import BatchRecord
from worker.jobs.identifiers import ids_in_order, new_job_id
from worker.jobs.records import Artifact
from worker.run.artifacts import JobFiles, of_measurement

PAIRS = 5
MOVED = 3  # the pair that fails
OPTIONS = {
    "mode": "measure",
    "audit": False,
    "quality": {"samples": 64, "emd_samples": 16},
    "gates": {"point_to_surface.max": {"max": 0.01}},
}


@pytest.fixture
def context(tmp_path: Path) -> Iterator[Context]:
    with EmbeddedBroker(tmp_path / "broker") as broker:
        settings = ServiceSettings(redis_url=broker.url, data_dir=tmp_path)
        with open_context(settings) as opened:
            yield opened


@pytest.fixture(scope="module")
def made() -> tuple[JobFiles, JobFiles]:
    """What two jobs leave: one that passes its gate, and one that does not."""
    vertices, faces = shapes.sphere(1)
    reference = MeshFile("mug.obj", shapes.obj(vertices, faces))
    sources = [reference, MeshFile("mug.obj", shapes.obj(vertices * 1.2, faces))]
    passed, failed = (
        of_measurement("mug.obj", measurement(source, reference, parse_options(OPTIONS)))
        for source in sources
    )
    return passed, failed


def finished(
    context: Context, made: tuple[JobFiles, JobFiles], *, keeps: bool = True
) -> BatchRecord:
    """A batch of which one job has not passed; without ``keeps`` as an older worker ends jobs."""
    batch = BatchRecord(id=new_job_id(), created=datetime.now(UTC), pairs=PAIRS, name="nightly")
    jobs = [
        make_job().model_copy(update={"id": job_id, "batch": batch.id, "name": f"mug-{number}"})
        for number, job_id in enumerate(islice(ids_in_order(), PAIRS))
    ]
    context.batches.stage(batch.id, jobs)
    context.batches.commit(batch, capacity=PAIRS)
    context.batches.carry_on(batch.id)
    for number, job in enumerate(jobs):
        left = made[number == MOVED]
        report = left.files["report"]
        artifact = Artifact(
            digest=context.blobs.put(report.data, job.id),
            media_type=report.media_type,
            filename=report.filename,
            size=len(report.data),
        )
        context.ledger.succeed(
            job.id,
            context.ledger.begin(job.id),
            {"report": artifact},
            verdict=left.verdict,
            summary=left.summary,
            judgement=left.judgement if keeps else None,
        )
    return context.batches.get(batch.id)


def endings(run: GateRun) -> list[tuple[str, str]]:
    return [(asset.name, asset.ending) for asset in run.assets]


def test_it_needs_no_report_and_says_what_the_reports_say(
    context: Context, made: tuple[JobFiles, JobFiles], tmp_path: Path
) -> None:
    from_reports = result_of(finished(context, made, keeps=False), context)
    batch = finished(context, made)
    for path in (tmp_path / "blobs").rglob("*"):
        if path.is_file():
            path.unlink()

    result = result_of(batch, context)

    assert result == from_reports
    assert result.counts == {"error": 0, "fail": 1, "not_tested": 0, "pass": PAIRS - 1}
    assert endings(result)[MOVED] == (f"mug-{MOVED}", "fail")
    [check] = result.assets[MOVED].checks()
    assert check.words.startswith("worst deviation")


def test_deleted_and_expired_jobs_are_errors(
    context: Context, made: tuple[JobFiles, JobFiles]
) -> None:
    batch = finished(context, made)
    first, second, *_ = context.batches.job_ids(batch.id)

    context.ledger.delete(first)
    context.ledger.expire(second)
    result = result_of(batch, context)

    assert [name for name, _ in endings(result)] == [
        *("mug-1", "mug-2", "mug-3", "mug-4"),
        "deleted pairs",
    ]
    assert result.counts == {"error": 2, "fail": 1, "not_tested": 0, "pass": PAIRS - 3}
    assert result.assets[-1].error is not None
    assert "1 of the 5 pairs" in result.assets[-1].error.message
    assert context.batches.judgements(batch.id, [first, second]) == [None, None]


@pytest.mark.parametrize("entered", [0, 100])
def test_a_pair_that_was_canceled_before_its_job_was_entered_is_an_error(
    context: Context, entered: int
) -> None:
    pairs = 102  # of which a step enters a hundred
    batch = BatchRecord(id=new_job_id(), created=datetime.now(UTC), pairs=pairs)
    jobs = [
        make_job().model_copy(update={"id": job_id, "batch": batch.id})
        for job_id in islice(ids_in_order(), pairs)
    ]
    context.batches.stage(batch.id, jobs)
    context.batches.commit(batch, capacity=pairs)
    if entered:
        context.batches.carry_on(batch.id)
    context.batches.request_cancel(batch.id)
    context.batches.carry_on(batch.id)

    result = result_of(context.batches.get(batch.id), context)

    assert len(result.assets) == result.counts["error"] == pairs
    assert [name for name, _ in endings(result)][entered:] == [
        f"pairs[{index}]" for index in range(entered, pairs)
    ]


def test_nothing_of_a_deleted_batch_is_left(
    context: Context, made: tuple[JobFiles, JobFiles]
) -> None:
    batch = finished(context, made)

    for job_id in context.batches.job_ids(batch.id):
        context.ledger.delete(job_id)

    with pytest.raises(ProblemError):
        result_of(batch, context)
    assert context.redis.keys(f"*{batch.id}*") == []
