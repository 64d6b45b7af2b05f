"""Webhooks by the process that delivers them, to a server on this machine."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from redis import Redis
from standardwebhooks import Webhook

from service.access.keys import KeyStore
from tests.integration.jobs import make_job
from tests.integration.receiver import Receiver, receiving
from tests.integration.telling import SECRET, Deliver, ended_job, is_settled, log_lines
from tests.integration.waiting import wait_for
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import WEBHOOKS
from worker.webhooks.schedule import DUE, TRIES
from worker.webhooks.signing import SECRETS


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: a message left by one would be delivered in the next."""
    return own_broker


def test_the_end_of_a_job_is_told_once_and_signed(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver
) -> None:
    record = ended_job(ledger, receiver.url)

    with deliver():
        receiver.wait_for(1)
        wait_for(lambda: is_settled(redis))

    [(headers, body)] = receiver.received
    told = Webhook(SECRET).verify(body, headers)
    assert told["type"] == "job.succeeded"
    assert told["data"]["id"] == record.id
    assert told["data"]["labels"] == ["nightly"]
    assert headers["webhook-id"] == f"{record.id}_succeeded_1"


def test_a_job_sent_with_a_key_is_signed_with_the_keys_secret(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver
) -> None:
    made = KeyStore(redis).create("pipeline", ["submit"])
    ended_job(ledger, receiver.url, owner=made.key.id)

    with deliver():
        receiver.wait_for(1)

    [(headers, body)] = receiver.received
    assert Webhook(made.webhook_secret).verify(body, headers)["type"] == "job.succeeded"


def test_nothing_is_sent_in_the_name_of_a_revoked_key(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver
) -> None:
    made = KeyStore(redis).create("pipeline", ["submit"])
    ended_job(ledger, receiver.url, owner=made.key.id)
    KeyStore(redis).revoke(made.key.id)

    with deliver():
        wait_for(lambda: is_settled(redis))

    assert receiver.received == []


def test_what_is_not_received_is_sent_again_under_the_same_name(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver
) -> None:
    receiver.statuses = [500, 503, 204]
    ended_job(ledger, receiver.url)

    with deliver():
        receiver.wait_for(3)
        wait_for(lambda: is_settled(redis))

    assert len({headers["webhook-id"] for headers, _ in receiver.received}) == 1
    assert len({body for _, body in receiver.received}) == 1


def test_what_is_never_received_is_given_up(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver, tmp_path: Path
) -> None:
    receiver.statuses = [500]
    record = ended_job(ledger, receiver.url)

    with deliver(MESHCONE_WEBHOOK_ATTEMPTS="2"):
        wait_for(lambda: is_settled(redis))

    given_up = log_lines(tmp_path)[-1]
    assert len(receiver.received) == 2
    assert given_up["event"] == "webhook given up"
    assert given_up["job_id"] == record.id


def test_who_is_gone_is_not_asked_again(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver
) -> None:
    receiver.statuses = [410]
    ended_job(ledger, receiver.url)

    with deliver():
        wait_for(lambda: is_settled(redis))

    assert len(receiver.received) == 1


def test_a_redirect_is_not_followed(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver
) -> None:
    with receiving() as elsewhere:
        receiver.statuses, receiver.location = [307], elsewhere.url
        ended_job(ledger, receiver.url)

        with deliver(MESHCONE_WEBHOOK_ATTEMPTS="2"):
            wait_for(lambda: is_settled(redis))

        assert len(receiver.received) == 2
        assert elsewhere.received == []


def test_a_name_that_leads_to_this_machine_is_not_connected_to(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver, tmp_path: Path
) -> None:
    # Passed at submission, as a name does whose owner changes what it stands for later.
    ended_job(ledger, receiver.url.replace("127.0.0.1", "localhost"))

    with deliver(MESHCONE_WEBHOOK_PRIVATE_ADDRESSES="false", MESHCONE_WEBHOOK_ATTEMPTS="1"):
        wait_for(lambda: is_settled(redis))

    assert receiver.received == []
    assert "not a public one" in str(log_lines(tmp_path)[-1]["reason"])


def test_a_delivery_cut_off_is_made_by_the_next_process(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver
) -> None:
    record = ended_job(ledger, receiver.url)
    message = f"{record.id}_succeeded_1"
    with deliver(MESHCONE_WEBHOOK_PRIVATE_ADDRESSES="false") as process:
        wait_for(lambda: redis.hexists(TRIES, message))
        process.kill()
    redis.zadd(DUE, {message: 0})  # as when the time it was taken for is over

    with deliver():
        receiver.wait_for(1)


def test_a_broker_that_went_away_is_waited_for(
    broker: EmbeddedBroker, ledger: Ledger, receiver: Receiver, deliver: Deliver
) -> None:
    with deliver() as process:
        broker.stop()
        broker.start()
        ended_job(ledger, receiver.url)
        receiver.wait_for(1)
        assert process.poll() is None


def test_only_ends_are_told_and_only_where_asked(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver
) -> None:
    silent, running = make_job(), make_job().model_copy(update={"webhook": receiver.url})
    for record in (silent, running):
        ledger.create(record)
        ledger.begin(record.id)
    ledger.succeed(silent.id, 1, {})
    with deliver():
        wait_for(lambda: redis.xlen(WEBHOOKS) == 0)
        assert is_settled(redis)
        ledger.retry(running.id, 1)
        ledger.cancel(running.id)
        receiver.wait_for(1)

    [(_, body)] = receiver.received
    assert json.loads(body)["type"] == "job.canceled"


def test_a_job_deleted_before_its_webhook_is_collected_is_told_of(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver
) -> None:
    record = ended_job(ledger, receiver.url)
    ledger.delete(record.id)

    with deliver():
        receiver.wait_for(1)
        wait_for(lambda: is_settled(redis))

    [(headers, body)] = receiver.received
    told = Webhook(SECRET).verify(body, headers)
    assert told["data"]["id"] == record.id
    assert told["data"]["labels"] == ["nightly"]


def test_a_delivery_that_crashes_counts_as_an_attempt_and_is_given_up(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver, tmp_path: Path
) -> None:
    redis.hset(SECRETS, "careless", "whsec_" + 33 * "A")  # that many digits decode to no bytes
    crashing = ended_job(ledger, receiver.url, owner="careless")
    sound = ended_job(ledger, receiver.url)

    with deliver(MESHCONE_WEBHOOK_ATTEMPTS="2"):
        wait_for(lambda: is_settled(redis))

    lines = [line for line in log_lines(tmp_path) if line.get("job_id") == crashing.id]
    assert [line["event"] for line in lines if "tries" in line] == [
        "webhook not delivered",
        "webhook given up",
    ]
    assert [json.loads(body)["data"]["id"] for _, body in receiver.received] == [sound.id]
    assert ledger.index.counters()["webhooks:given_up"] == 1
    assert ledger.index.counters()["webhooks:delivered"] == 1


def test_a_message_that_ends_every_process_is_given_up(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver, tmp_path: Path
) -> None:
    record = ended_job(ledger, receiver.url)
    redis.hset(TRIES, f"{record.id}_succeeded_1", 14)  # begun twice as often as it may be tried

    with deliver():
        wait_for(lambda: is_settled(redis))

    assert receiver.received == []
    assert log_lines(tmp_path)[-1]["reason"] == "no attempt came to its end"
