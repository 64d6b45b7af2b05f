"""A request that is repeated under one key makes one job."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest
from redis import Redis

from service.api.sender import prolonged
from tests.integration.jobs import make_job
from tests.integration.waiting import PATIENCE
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.errors import KeyReusedError, QueueFullError, UnknownJobError
from worker.jobs.idempotency import CLAIM_SECONDS, BoundKey, KeyClaims, KeyInUseError, key_place
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger


@pytest.fixture
def claims(broker: EmbeddedBroker) -> Iterator[KeyClaims]:
    with connect_text(broker.url) as client:
        yield KeyClaims(client)


@pytest.fixture
def place() -> str:
    return key_place("somebody", new_job_id())


def test_the_same_request_makes_one_job(ledger: Ledger, place: str) -> None:
    key = BoundKey(place, "fingerprint", 60)
    first, second = make_job(), make_job()

    assert ledger.create(first, key=key) == first.id
    assert ledger.create(second, key=key) == first.id
    with pytest.raises(UnknownJobError):
        ledger.get(second.id)


def test_another_request_under_the_same_key_is_refused(ledger: Ledger, place: str) -> None:
    ledger.create(make_job(), key=BoundKey(place, "one", 60))

    with pytest.raises(KeyReusedError):
        ledger.create(make_job(), key=BoundKey(place, "another", 60))


def test_a_key_is_claimed_while_its_request_is_under_way(claims: KeyClaims, place: str) -> None:
    claim = claims.claim(place)

    with pytest.raises(KeyInUseError):
        claims.claim(place)
    claims.release(claim)
    claims.claim(place)


def test_a_claim_lasts_for_as_long_as_its_request(
    redis: Redis, claims: KeyClaims, place: str
) -> None:
    claim = claims.claim(place)
    redis.pexpire(place, 100)  # as where its files have been coming for ten seconds

    async def while_files_come() -> None:
        async with prolonged(claims, claim, every=0.01):
            while redis.pttl(place) <= 100:
                await asyncio.sleep(0.01)

    asyncio.run(asyncio.wait_for(while_files_come(), PATIENCE))

    with pytest.raises(KeyInUseError):
        claims.claim(place)
    claims.release(claim)


def test_a_claim_that_another_request_has_now_is_not_prolonged(
    redis: Redis, claims: KeyClaims, place: str
) -> None:
    lost = claims.claim(place)
    claims.release(lost)
    claims.claim(place)
    redis.expire(place, 5)

    claims.prolong(lost)

    assert redis.ttl(place) <= 5


def test_a_key_is_remembered_for_as_long_as_before_after_its_claim_was_prolonged(
    redis: Redis, ledger: Ledger, claims: KeyClaims, place: str
) -> None:
    claim = claims.claim(place)
    ledger.create(make_job(), key=BoundKey(place, "fingerprint", 60))

    claims.prolong(claim)

    assert redis.ttl(place) > CLAIM_SECONDS


def test_a_key_that_has_made_its_job_is_free_to_be_repeated(
    ledger: Ledger, claims: KeyClaims, place: str
) -> None:
    claim = claims.claim(place)
    job = make_job()
    ledger.create(job, key=BoundKey(place, "fingerprint", 60))

    claims.release(claim)
    again = claims.claim(place)

    assert (again.job_id, again.fingerprint) == (job.id, "fingerprint")
    assert ledger.create(make_job(), key=BoundKey(place, "fingerprint", 60)) == job.id


def test_two_senders_may_choose_the_same_key() -> None:
    assert key_place("a", "bc") != key_place("ab", "c")


def test_no_job_is_created_beyond_the_capacity_of_the_queue(ledger: Ledger) -> None:
    waiting = ledger.index.count("queued")
    one_more = make_job()

    ledger.create(one_more, capacity=waiting + 1)

    with pytest.raises(QueueFullError):
        ledger.create(make_job(), capacity=waiting + 1)
    ledger.cancel(one_more.id)
    ledger.create(make_job(), capacity=waiting + 1)
