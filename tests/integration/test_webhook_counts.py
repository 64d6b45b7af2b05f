"""Webhooks that cannot be sent: what is refused beforehand, and what an operator sees."""

from __future__ import annotations

from pathlib import Path

import pytest
from prometheus_client.parser import text_string_to_metric_families
from redis import Redis
from starlette.testclient import TestClient

from meshcone.errors import InputError
from service.access.keys import KeyStore
from service.api.app import create_app
from service.settings import ServiceSettings
from tests.integration.jobs import make_job
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import WEBHOOKS
from worker.jobs.outbox import KEPT
from worker.webhooks.signing import SECRETS, SigningSecrets


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: these fill it."""
    return own_broker


def test_what_falls_out_of_a_full_outbox_is_in_the_metrics(
    broker: EmbeddedBroker, redis: Redis, ledger: Ledger, tmp_path: Path
) -> None:
    with redis.pipeline(transaction=False) as pipeline:
        for _ in range(KEPT):
            pipeline.xadd(WEBHOOKS, {"job": "old"})
        pipeline.execute()
    for _ in range(2):
        record = make_job().model_copy(update={"webhook": "https://example.org/hook"})
        ledger.create(record)
        ledger.cancel(record.id)

    headers = {"Authorization": f"Bearer {KeyStore(redis).create('scraper', ['admin']).token}"}
    with TestClient(create_app(ServiceSettings(redis_url=broker.url, data_dir=tmp_path))) as http:
        text = http.get("/metrics", headers=headers).text

    samples = {
        (sample.name, sample.labels.get("outcome")): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }
    assert samples["meshcone_webhooks_total", "dropped"] == 2
    assert samples["meshcone_webhooks_pending", None] == KEPT


@pytest.mark.parametrize("secret", ["whsec_" + 33 * "A", "whsec_" + 28 * "A", "", 32 * "A"])
def test_no_key_is_given_a_secret_that_nothing_can_be_signed_with(
    redis: Redis, secret: str
) -> None:
    with pytest.raises(InputError, match="a webhook secret is"):
        SigningSecrets(redis).put("careless", secret)

    assert not redis.hexists(SECRETS, "careless")
