"""Real processes, started once for all integration tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.integration.jobs import make_job
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.jobs.records import JobRecord


@pytest.fixture(scope="session")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[EmbeddedBroker]:
    with EmbeddedBroker(tmp_path_factory.mktemp("data")) as started:
        yield started


@pytest.fixture
def ledger(broker: EmbeddedBroker) -> Iterator[Ledger]:
    with connect_text(broker.url) as client:
        yield Ledger(client)


@pytest.fixture
def queued_job() -> JobRecord:
    return make_job()
