"""Of all that could reconcile, one does."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from redis import Redis

from tests.integration.waiting import wait_for
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.identifiers import new_job_id
from worker.upkeep.main import Turn, every


@pytest.fixture
def connection(broker: EmbeddedBroker) -> Iterator[Redis]:
    with connect_text(broker.url) as opened:
        yield opened


@pytest.fixture
def name() -> str:
    return f"lock-{new_job_id()}"


def test_one_of_two_has_the_turn_and_keeps_it(connection: Redis, name: str) -> None:
    first, second = Turn(connection, name, 60), Turn(connection, name, 60)

    assert first.is_ours()
    assert not second.is_ours()
    assert first.is_ours()


def test_the_turn_of_one_that_died_goes_to_another(connection: Redis, name: str) -> None:
    dead, heir = Turn(connection, name, 0.2), Turn(connection, name, 60)
    assert dead.is_ours()

    wait_for(heir.is_ours)

    assert not dead.is_ours()


def test_work_that_fails_unexpectedly_is_logged_and_tried_again(
    connection: Redis, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    class Enough(BaseException):
        """Ends the loop."""

    tries = []

    def work() -> None:
        tries.append(None)
        raise ValueError("a fault") if len(tries) == 1 else Enough

    with pytest.raises(Enough):
        every(0.01, Turn(connection, name, 60), work, lambda: None)

    assert "ValueError: a fault" in caplog.text
