from __future__ import annotations

import pytest

from service.api.routes.jobs import cursor_after, place_before
from worker.jobs.identifiers import new_job_id


def test_a_cursor_leads_back_to_its_job() -> None:
    job_id = new_job_id()

    assert place_before(cursor_after(job_id)) == job_id
    assert place_before(cursor_after(f"2:{job_id}")) == f"2:{job_id}"


def test_a_cursor_does_not_show_its_job() -> None:
    job_id = new_job_id()

    assert job_id not in cursor_after(job_id)
    assert place_before(job_id) is None


@pytest.mark.parametrize("made_up", ["", "1", "é" * 22, "A" * 24, "../../etc", "\x00" * 22])
def test_what_is_no_cursor_is_recognised(made_up: str) -> None:
    assert place_before(made_up) is None


def test_bits_that_say_nothing_make_no_second_cursor() -> None:
    cursor = cursor_after(new_job_id())
    alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"
    twin = cursor[:-1] + alphabet[alphabet.index(cursor[-1]) + 1]

    assert place_before(twin) is None
