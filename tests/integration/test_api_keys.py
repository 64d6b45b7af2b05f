"""API keys against a real broker: scopes, paces, revocation."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from redis import Redis
from starlette.testclient import TestClient

from meshcone.errors import InputError
from service.access.keys import KEYS, KeyStore, NewKey, Quota, Scope, parse_token
from service.api.app import create_app
from service.settings import ServiceSettings
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker, running_broker_url


@pytest.fixture
def store(redis: Redis) -> KeyStore:
    return KeyStore(redis)


@pytest.fixture
def http(broker: EmbeddedBroker, tmp_path: Path) -> Iterator[TestClient]:
    """An application that asks for keys."""
    with TestClient(create_app(ServiceSettings(redis_url=broker.url, data_dir=tmp_path))) as client:
        yield client


def bearer(made: NewKey) -> dict[str, str]:
    return {"Authorization": f"Bearer {made.token}"}


def test_what_the_broker_holds_does_not_open_the_door(store: KeyStore, redis: Redis) -> None:
    made = store.create("ci", ["read"])

    stored = redis.hget(KEYS, made.key.id)

    _, secret = parse_token(made.token) or ("", "")
    assert len(secret) > 40
    assert secret not in str(stored)
    assert made.key.digest in str(stored)


@pytest.mark.parametrize(
    ("scopes", "method", "path", "status"),
    [
        (["read"], "GET", "/v1/jobs", 200),
        (["read"], "POST", "/v1/jobs", 403),
        (["submit"], "GET", "/v1/jobs", 403),
        (["submit"], "POST", "/v1/jobs", 415),  # let in, and asked for a form
        (["submit"], "GET", "/metrics", 403),
        (["read"], "GET", "/metrics", 200),
        (["read", "submit"], "DELETE", "/v1/jobs?label=a", 403),
        (["delete"], "DELETE", "/v1/jobs?label=a", 200),
        (["admin"], "GET", "/metrics", 200),
        (["admin"], "GET", "/v1/jobs", 200),
    ],
)
def test_a_key_opens_what_its_scopes_say(
    store: KeyStore, http: TestClient, scopes: list[Scope], method: str, path: str, status: int
) -> None:
    answer = http.request(method, path, headers=bearer(store.create("ci", scopes)))

    assert answer.status_code == status
    if status == 403:
        assert 'error="insufficient_scope"' in answer.headers["www-authenticate"]


def test_a_revoked_key_opens_nothing(store: KeyStore, http: TestClient) -> None:
    made = store.create("ci", ["read"])
    assert http.get("/v1/jobs", headers=bearer(made)).status_code == 200

    store.revoke(made.key.id)

    assert http.get("/v1/jobs", headers=bearer(made)).status_code == 401
    with pytest.raises(InputError, match="there is no key"):
        store.revoke(made.key.id)


def test_the_id_of_a_key_with_another_secret_opens_nothing(
    store: KeyStore, http: TestClient
) -> None:
    one, other = store.create("one", ["read"]), store.create("other", ["read"])
    forged = f"mc_{one.key.id}_{other.token.rpartition('_')[2]}"

    answer = http.get("/v1/jobs", headers={"Authorization": f"Bearer {forged}"})

    assert answer.status_code == 401


def test_more_requests_than_allowed_are_told_when_to_come_again(
    store: KeyStore, http: TestClient
) -> None:
    made = store.create("eager", ["read"], Quota(requests_per_minute=3))

    answers = [http.get("/v1/jobs", headers=bearer(made)) for _ in range(4)]

    assert [answer.status_code for answer in answers] == [200, 200, 200, 429]
    assert [answer.headers["ratelimit"].split(";")[1] for answer in answers[:3]] == [
        "r=2",
        "r=1",
        "r=0",
    ]
    assert answers[3].headers["ratelimit-policy"] == '"requests";q=3;w=60'
    assert 1 <= int(answers[3].headers["retry-after"]) <= 20
    assert answers[3].json()["type"] == "urn:meshcone:problem:rate-limit"


def test_one_keys_requests_are_not_anothers(store: KeyStore, http: TestClient) -> None:
    eager = store.create("eager", ["read"], Quota(requests_per_minute=1))
    other = store.create("other", ["read"], Quota(requests_per_minute=1))
    for _ in range(2):
        http.get("/v1/jobs", headers=bearer(eager))

    assert http.get("/v1/jobs", headers=bearer(other)).status_code == 200


def test_a_key_without_limits_is_told_of_none(store: KeyStore, http: TestClient) -> None:
    made = store.create("free", ["read"], Quota(requests_per_minute=0))

    assert "ratelimit" not in http.get("/v1/jobs", headers=bearer(made)).headers


def test_the_embedded_broker_is_found_by_its_data_directory(tmp_path: Path) -> None:
    directory = tmp_path / 'a "quoted" \\ name'
    with pytest.raises(InputError, match="no broker runs"):
        running_broker_url(directory)

    with EmbeddedBroker(directory) as broker:
        assert running_broker_url(directory) == broker.url
        with connect_text(running_broker_url(directory)) as client:
            assert client.ping()
