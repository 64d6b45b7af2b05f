"""Faults of every kind at random times, under load: nothing that was accepted is lost."""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.refine import refine
from service.client import Client
from service.stack import Stack
from tests import shapes
from tests.holding import Hold
from tests.integration.outcomes import times_succeeded
from tests.integration.restarted import restarted_stack
from tests.integration.waiting import insist, wait_for
from tests.processes import horses_of, upkeep_of
from worker.broker.connections import connect_text
from worker.jobs.ledger import Ledger
from worker.settings import WorkerSettings

BATCHES = 10
BATCH = 20  # jobs, sent at once while one thing is killed
HELD = 3  # of them, which keep both workers busy
SMALL = {"effort": "fast", "quality": {"samples": 256, "emd_samples": 32}}
SEED = 6


@dataclass(frozen=True)
class Pair:
    """A small job and what it has to make."""

    source: MeshFile
    reference: MeshFile
    expected: bytes


@pytest.fixture(scope="module")
def pairs() -> list[Pair]:
    vertices, faces = shapes.sphere(1)
    reference = MeshFile("ball.obj", shapes.obj(vertices, faces))
    options = parse_options(SMALL)
    made = []
    for seed in range(4):
        source = MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices, seed=seed), faces))
        made.append(Pair(source, reference, refine(source, reference, options).data))
    return made


@pytest.fixture
def hold(tmp_path: Path) -> Hold:
    (tmp_path / "held").mkdir()
    return Hold(tmp_path / "held")


@pytest.fixture
def stormy(tmp_path: Path, hold: Hold) -> Iterator[Stack]:
    settings = WorkerSettings(data_dir=tmp_path, heartbeat_timeout=3, reconcile_interval=0.5)
    with restarted_stack(settings, hold, workers=2, log=tmp_path / "log") as stack:
        yield stack


def kill(*pids: int) -> None:
    for pid in pids:
        with suppress(ProcessLookupError):  # it has just ended by itself, or started none again
            os.kill(pid, signal.SIGKILL)


def kill_horse(stack: Stack, luck: random.Random) -> None:
    kill(*horses_of(busy_worker(stack, luck)))


def kill_worker(stack: Stack, luck: random.Random) -> None:
    kill(busy_worker(stack, luck))


def kill_worker_and_horse(stack: Stack, luck: random.Random) -> None:
    worker = busy_worker(stack, luck)
    kill(worker, *horses_of(worker))


def kill_reconcilers(stack: Stack, _luck: random.Random) -> None:
    kill(*(pid for worker in stack.worker_pids() for pid in upkeep_of(worker)))


def kill_every_worker(stack: Stack, _luck: random.Random) -> None:
    """Whichever of their reconcilers held the lock, it dies holding it."""
    kill(*stack.worker_pids())


def kill_api(stack: Stack, _luck: random.Random) -> None:
    kill(stack.pids()["API"])


def kill_broker(stack: Stack, _luck: random.Random) -> None:
    kill(stack.pids()["broker"])


FAULTS: list[Callable[[Stack, random.Random], None]] = [
    kill_horse,
    kill_worker,
    kill_worker_and_horse,
    kill_reconcilers,
    kill_every_worker,
    kill_api,
    kill_broker,
]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_every_accepted_job_succeeds_once_whatever_is_killed_meanwhile(
    stormy: Stack, hold: Hold, pairs: list[Pair]
) -> None:
    luck = random.Random(SEED)  # noqa: S311 - nothing secret
    faults = [*FAULTS, *luck.choices(FAULTS, k=BATCHES - len(FAULTS))]
    luck.shuffle(faults)
    accepted: dict[str, Pair] = {}

    with ThreadPoolExecutor(BATCH) as pool, Client(stormy.url) as client:
        for number, fault in enumerate(faults):
            keys = [f"{number}-{each}" for each in range(BATCH)]
            batch = [luck.choice(pairs) for _ in keys]
            # However fast the machine is, work is left when the fault strikes: some jobs of
            # the batch, which come up when they come up, wait until it has struck.
            for each in luck.sample(range(BATCH), HELD):
                batch[each] = replace(batch[each], source=hold.mesh(batch[each].source))
            sent = [
                pool.submit(succeed, client, key, pair)
                for key, pair in zip(keys, batch, strict=True)
            ]
            time.sleep(luck.uniform(0.1, 1.5))
            fault(stormy, luck)
            struck = time.monotonic()
            hold.release()
            accepted |= dict(each.result() for each in sent)
            print(f"{fault.__name__}: recovered after {time.monotonic() - struck:.1f} s")

    assert len(accepted) == BATCHES * BATCH
    assert_done_once(stormy, accepted)


def succeed(client: Client, key: str, pair: Pair) -> tuple[str, Pair]:
    """Send a job until it is accepted, and wait until it has succeeded."""

    def submit() -> str:
        return client.submit(pair.source, pair.reference, SMALL, idempotency_key=key).id

    job_id = insist(submit)
    wait_for(lambda: insist(lambda: client.job(job_id)).state == "succeeded", pause=0.5)
    return job_id, pair


def busy_worker(stack: Stack, luck: random.Random) -> int:
    def busy() -> list[int]:
        return [pid for pid in stack.worker_pids() if horses_of(pid)]

    found: list[int] = []

    def look() -> bool:
        found[:] = busy()
        return bool(found)

    wait_for(look)
    return luck.choice(found)


def assert_done_once(stack: Stack, accepted: Mapping[str, Pair]) -> None:
    with Client(stack.url) as client, connect_text(stack.redis_url) as connection:
        for job_id, pair in accepted.items():
            assert client.job(job_id).state == "succeeded"
            assert times_succeeded(connection, job_id) == 1
            assert client.mesh(job_id) == pair.expected
        # Whoever was not answered and asked again, with the same key, made no second job.
        counters = Ledger(connection).index.counters()
        assert counters["transitions::queued"] == len(accepted)
        assert counters["transitions:running:succeeded"] == len(accepted)
