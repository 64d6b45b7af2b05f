"""What the ledger keeps of a job is read as it was meant, by later versions too."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from worker.jobs.records import JobProgress, JobRecord, StoredFile

MESH, BUFFER, OTHER = (
    StoredFile(name=name, digest=letter * 64, size=3)
    for name, letter in (("a.gltf", "a"), ("a.bin", "b"), ("a.bin", "c"))
)


def record(**fields: Any) -> JobRecord:
    created = datetime(2026, 1, 1, tzinfo=UTC)
    return JobRecord(id="1", created=created, source=MESH, reference=MESH, options={}, **fields)


def test_a_record_from_before_there_were_sides_is_read() -> None:
    fields = record(resources=(BUFFER,)).encoded()
    del fields["source_resources"], fields["reference_resources"]

    old = JobRecord.decoded(fields)

    assert old == record(resources=(BUFFER,))
    assert old.files == (MESH, MESH, BUFFER)


def test_each_side_keeps_its_own_file_of_a_name() -> None:
    kept = JobRecord.decoded(
        record(source_resources=(BUFFER,), reference_resources=(OTHER,)).encoded()
    )

    assert kept.source_resources == (BUFFER,)
    assert kept.reference_resources == (OTHER,)
    assert set(kept.files) == {MESH, BUFFER, OTHER}


def test_a_job_has_come_no_way_while_its_files_are_fetched() -> None:
    fetching = JobProgress.fetching()

    assert (fetching.round, fetching.rounds, fetching.fraction) == (0, 0, 0.0)


def test_a_job_that_reported_no_round_ends_with_none() -> None:
    done = JobProgress.done(None)

    assert (done.round, done.rounds, done.fraction) == (0, 0, 1.0)
