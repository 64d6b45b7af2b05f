"""What jobs have made, put where their senders want it."""

from __future__ import annotations

import asyncio
import io
import json

import pytest
from redis import Redis

from meshcone.errors import InputError
from tests.integration.file_server import Answer, FileServer, file_server
from tests.integration.jobs import make_job
from tests.integration.object_store import object_store
from tests.integration.transferring import Transfer
from tests.integration.waiting import wait_for
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import DELIVERIES, DELIVERY_TRIES
from worker.jobs.records import Artifact, JobRecord, Output
from worker.storage.blobs import BlobStore
from worker.transfers.buckets import Buckets
from worker.transfers.budget import Budget

REPORT = b'{"mode": "refine"}' * 50_000


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: what is due in one is delivered in no other."""
    return own_broker


def ended_job(ledger: Ledger, blobs: BlobStore, **outputs: Output) -> JobRecord:
    """A job that has made a report and a preview, which are to be put somewhere."""
    job = make_job().model_copy(update={"outputs": outputs})
    ledger.create(job)
    attempt = ledger.begin(job.id)
    made = Artifact(
        digest=blobs.put(REPORT, job.id),
        media_type="application/json",
        filename="mug.report.json",
        size=len(REPORT),
    )
    ledger.succeed(job.id, attempt, {"report": made, "preview": made})
    return job


def is_settled(redis: Redis) -> bool:
    return not redis.exists(DELIVERIES, DELIVERY_TRIES)


def output_of(ledger: Ledger, job: JobRecord, name: str = "report") -> Output:
    return dict(ledger.get(job.id).outputs)[name]  # type: ignore[index]


def test_a_result_is_put_where_it_is_wanted(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    job = ended_job(ledger, blobs, report=Output(url=server.has("/r", b"") + "?signature=3f9a"))

    with transfer():
        wait_for(lambda: is_settled(redis))

    [seen] = server.seen
    assert (seen.method, seen.path, seen.body) == ("PUT", "/r?signature=3f9a", REPORT)
    assert seen.headers["content-type"] == "application/json"
    output = output_of(ledger, job)
    assert (output.state, output.tries, output.detail) == ("delivered", 1, None)
    assert output.finished is not None
    assert output.url == f"{server.url}/r"
    assert ledger.index.counters()["outputs:delivered"] == 1


def test_nothing_is_put_of_a_job_that_has_not_succeeded(
    ledger: Ledger, redis: Redis, server: FileServer
) -> None:
    job = make_job().model_copy(update={"outputs": {"report": Output(url=f"{server.url}/r")}})
    ledger.create(job)

    ledger.cancel(job.id)

    assert is_settled(redis)


def test_what_the_job_has_not_made_is_absent_and_the_rest_is_put(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    place = Output(url=server.has("/r", b""))
    job = ended_job(ledger, blobs, report=place, certificate=place)

    with transfer():
        wait_for(lambda: is_settled(redis))

    assert output_of(ledger, job).state == "delivered"
    assert output_of(ledger, job, "certificate").state == "absent"


def test_what_is_not_taken_is_put_again(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    server.answers["/r"] = [Answer(status=503), Answer(status=429), Answer(status=201)]
    job = ended_job(ledger, blobs, report=Output(url=f"{server.url}/r"))

    with transfer():
        wait_for(lambda: is_settled(redis))

    assert [seen.body == REPORT for seen in server.seen] == [True] * 3
    assert (output_of(ledger, job).state, output_of(ledger, job).tries) == ("delivered", 3)


def test_what_is_never_taken_is_given_up_and_the_job_has_succeeded_all_the_same(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    job = ended_job(ledger, blobs, report=Output(url=server.has("/r", b"", status=503)))

    with transfer(MESHCONE_OUTPUT_ATTEMPTS="2"):
        wait_for(lambda: is_settled(redis))

    output = output_of(ledger, job)
    assert (output.state, output.tries) == ("given_up", 2)
    assert output.detail == "127.0.0.1 answered 503 to the PUT of a result"
    assert ledger.get(job.id).state == "succeeded"
    assert ledger.index.counters()["outputs:given_up"] == 1


def test_what_is_refused_is_given_up_at_once_and_a_redirect_is_not_followed(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    statuses = (301, 307, 308, 400, 403, 404, 412)
    with file_server() as other:
        moved = {"Location": f"{other.url}/r"}
        jobs = [
            ended_job(
                ledger,
                blobs,
                report=Output(url=server.has(f"/{status}", b"", status=status, headers=moved)),
            )
            for status in statuses
        ]

        with transfer():
            wait_for(lambda: is_settled(redis))

        assert other.seen == []
    assert sorted(server.paths()) == [f"/{status}" for status in statuses]
    assert {output_of(ledger, job).state for job in jobs} == {"given_up"}


def test_a_result_in_the_hand_of_a_process_that_stops_is_put_by_the_next(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    job = ended_job(ledger, blobs, report=Output(url=server.has("/r", b"", delay=20.0)))
    with transfer():
        wait_for(lambda: server.seen)
    server.has("/r", b"")

    with transfer():
        wait_for(lambda: is_settled(redis))

    assert (output_of(ledger, job).state, output_of(ledger, job).tries) == ("delivered", 1)


def test_nothing_is_put_to_an_address_that_is_not_public(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    url = server.has("/r", b"").replace("127.0.0.1", "localhost")
    job = ended_job(ledger, blobs, report=Output(url=url))

    with transfer(MESHCONE_TRANSFER_PRIVATE_ADDRESSES="false"):
        wait_for(lambda: is_settled(redis))

    assert server.seen == []
    assert "not a public one" in str(output_of(ledger, job).detail)


def test_a_named_secret_is_shown(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    place = Output(url=server.has("/r", b""), authorization="store")
    ended_job(ledger, blobs, report=place)
    secrets = {"store": {"host": server.url, "value": "Bearer 3f9a"}}

    with transfer(MESHCONE_TRANSFER_AUTHORIZATIONS=json.dumps(secrets)):
        wait_for(lambda: is_settled(redis))

    assert server.seen[0].headers["authorization"] == "Bearer 3f9a"


def test_a_server_that_never_answers_is_given_up(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    job = ended_job(ledger, blobs, report=Output(url=server.has("/r", b"", delay=20.0)))

    with transfer(MESHCONE_OUTPUT_SECONDS="0.3", MESHCONE_OUTPUT_ATTEMPTS="1"):
        wait_for(lambda: is_settled(redis))

    assert "MESHCONE_OUTPUT_SECONDS" in str(output_of(ledger, job).detail)


def test_what_a_deleted_job_was_to_put_is_forgotten(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    job = ended_job(ledger, blobs, report=Output(url=server.has("/r", b"")))
    ledger.delete(job.id)

    with transfer():
        wait_for(lambda: is_settled(redis))

    assert server.seen == []


def test_tries_that_end_every_process_are_given_up(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    job = ended_job(ledger, blobs, report=Output(url=server.has("/r", b"")))
    redis.hset(DELIVERY_TRIES, f"{job.id}/report", 14)  # begun twice as often as it may be tried

    with transfer():
        wait_for(lambda: is_settled(redis))

    assert server.seen == []
    assert output_of(ledger, job).state == "given_up"


def test_a_result_whose_job_cannot_be_read_is_not_tried_for_ever(
    ledger: Ledger, redis: Redis, blobs: BlobStore, server: FileServer, transfer: Transfer
) -> None:
    damaged = ended_job(ledger, blobs, report=Output(url=server.has("/lost", b"")))
    redis.hset(f"meshcone:job:{damaged.id}", "outputs", '{"report": 5}')
    ended_job(ledger, blobs, report=Output(url=server.has("/r", b"")))

    with transfer():
        wait_for(lambda: is_settled(redis))

    assert server.paths() == ["/r"]


def test_a_result_is_put_in_a_bucket_that_is_allowed_and_in_no_other(
    ledger: Ledger,
    redis: Redis,
    blobs: BlobStore,
    transfer: Transfer,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with object_store("results") as store:
        for name, value in store.environment.items():
            monkeypatch.setenv(name, value)
        job = ended_job(
            ledger,
            blobs,
            report=Output(url="s3://results/nightly/mug.json"),
            preview=Output(url="s3://results/weekly/mug.json"),
        )
        with transfer(MESHCONE_OUTPUT_BUCKETS="s3://results/nightly"):
            wait_for(lambda: is_settled(redis))

        into = io.BytesIO()
        whole = Budget(len(REPORT))
        asyncio.run(Buckets(["s3://results"]).fetch("s3://results/nightly/mug.json", into, whole))
        with pytest.raises(InputError, match="no such object"):
            asyncio.run(
                Buckets(["s3://results"]).fetch("s3://results/weekly/mug.json", into, whole)
            )

    assert into.getvalue() == REPORT
    assert output_of(ledger, job).state == "delivered"
    assert "MESHCONE_OUTPUT_BUCKETS" in str(output_of(ledger, job, "preview").detail)
