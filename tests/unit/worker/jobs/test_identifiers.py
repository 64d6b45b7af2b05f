from __future__ import annotations

import time
import uuid

from worker.jobs.identifiers import is_job_id, new_job_id


def test_a_job_id_is_a_uuid_of_version_7() -> None:
    parsed = uuid.UUID(new_job_id())

    assert (parsed.version, parsed.variant) == (7, uuid.RFC_4122)


def test_job_ids_sort_by_creation_time() -> None:
    earlier = new_job_id()
    time.sleep(0.002)

    assert earlier < new_job_id()


def test_only_its_own_spelling_is_a_job_id() -> None:
    job_id = new_job_id()

    assert is_job_id(job_id)
    assert not is_job_id(job_id.upper())
    assert not is_job_id("../../etc")
