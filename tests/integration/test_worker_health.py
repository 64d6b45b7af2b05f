"""What a supervisor learns of a worker."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from service.stack import Stack
from worker.broker.embedded import EmbeddedBroker


def look(**settings: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "worker.health"],
        env={**os.environ, **settings},
        capture_output=True,
        text=True,
        timeout=60,
    )


def test_a_running_worker_is_healthy(stack: Stack) -> None:
    answer = look(MESHCONE_REDIS_URL=stack.redis_url)

    assert (answer.returncode, answer.stderr) == (0, "")


def test_without_a_worker_it_says_so(broker: EmbeddedBroker) -> None:
    answer = look(MESHCONE_REDIS_URL=broker.url, MESHCONE_QUEUE="nobodys")

    assert answer.returncode == 1
    assert answer.stderr == "no worker of this machine is known to the broker\n"


@pytest.mark.parametrize("url", ["", "unix:///nobody.sock"])
def test_without_a_broker_it_is_one_line(url: str, tmp_path: Path) -> None:
    answer = look(MESHCONE_REDIS_URL=url, MESHCONE_DATA_DIR=str(tmp_path))

    assert answer.returncode == 1
    assert answer.stderr.count("\n") == 1
