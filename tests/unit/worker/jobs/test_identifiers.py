from __future__ import annotations

import time
import uuid
from itertools import islice

import pytest

from worker.jobs import identifiers
from worker.jobs.identifiers import ids_in_order, is_job_id, new_job_id


def test_a_job_id_is_a_uuid_of_version_7() -> None:
    parsed = uuid.UUID(new_job_id())

    assert (parsed.version, parsed.variant) == (7, uuid.RFC_4122)


def test_job_ids_sort_by_creation_time() -> None:
    earlier = new_job_id()
    time.sleep(0.002)

    assert earlier < new_job_id()


def test_a_job_id_begins_with_the_millisecond_in_which_it_was_made() -> None:
    before = time.time_ns() // 1_000_000
    made = uuid.UUID(new_job_id()).int >> 80
    after = time.time_ns() // 1_000_000

    assert before <= made <= after


def test_ids_of_one_moment_keep_their_order_where_their_lower_half_is_full(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first, step = 2**62 - 2, 0
    numbers = iter([first, step, step, step])
    monkeypatch.setattr(identifiers.secrets, "randbits", lambda _: next(numbers))

    ids = list(islice(ids_in_order(), 4))

    assert ids == sorted(set(ids))


def test_only_its_own_spelling_is_a_job_id() -> None:
    job_id = new_job_id()

    assert is_job_id(job_id)
    assert not is_job_id(job_id.upper())
    assert not is_job_id("../../etc")
