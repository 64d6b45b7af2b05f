from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import pytest
from redis import Redis

from tests.integration.jobs import make_job
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger


@pytest.fixture
def client(tmp_path: Path) -> Iterator[Redis]:
    """A broker of the test's own, to be set up otherwise than any we start."""
    with EmbeddedBroker(tmp_path) as broker, connect_text(broker.url) as connected:
        yield connected


def test_a_job_is_created_when_the_broker_says_it_is_on_its_disk(client: Redis) -> None:
    client.config_set("appendfsync", "everysec")

    Ledger(client).create(make_job())

    assert client.info("commandstats")["cmdstat_waitaof"]["calls"] == 1


def test_a_broker_that_keeps_nothing_is_warned_of_once(
    client: Redis, caplog: pytest.LogCaptureFixture
) -> None:
    client.config_set("appendonly", "no")
    ledger = Ledger(client)
    first, second = make_job(), make_job()

    with caplog.at_level(logging.WARNING, logger="worker.jobs.durability"):
        ledger.create(first)
        ledger.create(second)

    assert ledger.get(second.id) == second
    [warning] = caplog.messages
    assert "does not keep jobs on disk" in warning
