"""The process that delivers webhooks, and jobs whose end it is to tell."""

from __future__ import annotations

import base64
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from redis import Redis

from tests.integration.jobs import make_job
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import WEBHOOKS
from worker.jobs.records import JobRecord
from worker.webhooks.schedule import DUE, MESSAGES, TRIES

SECRET = "whsec_" + base64.b64encode(bytes(range(32))).decode()

Deliver = Callable[..., AbstractContextManager["subprocess.Popen[bytes]"]]


@contextmanager
def telling(
    broker: EmbeddedBroker, directory: Path, **settings: str
) -> Iterator[subprocess.Popen[bytes]]:
    """Run the process while the body is worked through; it logs in the directory."""
    environment = {
        **os.environ,
        "MESHCONE_REDIS_URL": broker.url,
        "MESHCONE_WEBHOOK_SECRET": SECRET,
        "MESHCONE_WEBHOOK_PRIVATE_ADDRESSES": "true",
        "MESHCONE_WEBHOOK_FIRST_DELAY": "0.05",
        "MESHCONE_WEBHOOK_TIMEOUT": "2",
        **settings,
    }
    command = [sys.executable, "-m", "service.cli", "webhooks"]
    with (directory / "webhooks.log").open("ab") as log:
        process = subprocess.Popen(command, env=environment, stderr=log)
    try:
        yield process
    finally:
        process.terminate()
        assert process.wait(240) in (0, -9)


def log_lines(directory: Path) -> list[dict[str, object]]:
    """What it has logged."""
    return [json.loads(line) for line in (directory / "webhooks.log").read_text().splitlines()]


def ended_job(ledger: Ledger, url: str, owner: str | None = None) -> JobRecord:
    """A job that has succeeded, of which a URL is to be told."""
    record = make_job().model_copy(update={"webhook": url, "owner": owner, "labels": ("nightly",)})
    ledger.create(record)
    attempt = ledger.begin(record.id)
    ledger.succeed(record.id, attempt, {})
    return record


def is_settled(redis: Redis) -> bool:
    """Whether nothing is still to be told."""
    return redis.xlen(WEBHOOKS) == 0 and not redis.exists(DUE, MESSAGES, TRIES)
