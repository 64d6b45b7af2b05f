"""When two requests under one key are the same."""

from __future__ import annotations

from dataclasses import replace

from meshcone.options import Options
from service.api.submission.submission import IncomingFile, Submission
from worker.jobs.records import Output, StoredFile

SOURCE = IncomingFile(StoredFile(name="a.obj", digest="0" * 64, size=1))
REQUEST = Submission(
    job_id="one",
    source=SOURCE,
    reference=SOURCE,
    source_resources=(),
    reference_resources=(),
    resources=(),
    options=Options(),
    options_as_sent={},
    labels=(),
    webhook=None,
    outputs={"mesh": Output(url="https://a.example/1", authorization="one")},
)


def sent_to(authorization: str | None) -> Submission:
    place = Output(url="https://a.example/1", authorization=authorization)
    return replace(REQUEST, job_id="another", outputs={"mesh": place})


def test_the_same_request_has_the_same_fingerprint() -> None:
    assert sent_to("one").fingerprint() == REQUEST.fingerprint()


def test_a_request_that_shows_another_secret_where_its_results_go_is_another_one() -> None:
    assert sent_to("two").fingerprint() != REQUEST.fingerprint()
    assert sent_to(None).fingerprint() != REQUEST.fingerprint()


def test_a_key_that_was_bound_before_secrets_counted_still_fits() -> None:
    # What version 0.2.0 had of this request.
    before = "f4431956265f151e9886d07c6fcc272969c047d1e62593fdc0b66bb71f784819"

    assert sent_to(None).fingerprint() == before
