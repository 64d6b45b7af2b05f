"""How an attempt ends that does not end well, each in its own way."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests import shapes
from tests.holding import Hold
from tests.integration.waiting import wait_for
from tests.processes import has_ended, horses_of
from worker.broker.connections import connect_text
from worker.jobs.ledger import Ledger
from worker.jobs.records import JobRecord
from worker.settings import WorkerSettings

HUNGRY = {"quality": {"emd_samples": 5000}}  # 190 MB for its matching alone
SMALL = {"effort": "fast", "quality": {"samples": 256, "emd_samples": 64}}


@dataclass
class Installation:
    """One worker, with settings of its own."""

    stack: Stack
    client: Client
    ledger: Ledger
    hold: Hold

    def running(self, source: MeshFile, reference: MeshFile) -> tuple[str, int]:
        """The id of a job that is held, and its horse."""
        job_id = self.client.submit(self.hold.mesh(source), reference, SMALL).id
        [worker] = self.stack.worker_pids()
        wait_for(lambda: self.ledger.get(job_id).progress is not None)
        [horse] = horses_of(worker)
        return job_id, horse

    def ended(self, job_id: str) -> JobRecord:
        wait_for(lambda: self.ledger.get(job_id).has_ended)
        return self.ledger.get(job_id)


Install = Callable[..., Installation]


@contextmanager
def installed(directory: Path, hold: Hold, **settings: Any) -> Iterator[Installation]:
    """A service with a worker, and whoever uses it."""
    with (
        hold.stack(WorkerSettings(data_dir=directory, **settings), log=directory / "log") as stack,
        Client(stack.url) as client,
        connect_text(stack.redis_url) as connection,
    ):
        yield Installation(stack, client, Ledger(connection), hold)


@pytest.fixture
def install(tmp_path: Path, hold: Hold) -> Iterator[Install]:
    with ExitStack() as opened:
        yield lambda **settings: opened.enter_context(installed(tmp_path, hold, **settings))


@pytest.fixture(scope="module")
def confined(
    tmp_path_factory: pytest.TempPathFactory, service_hold: Hold
) -> Iterator[Installation]:
    """One whose jobs have little memory, and may write small files only."""
    directory = tmp_path_factory.mktemp("confined")
    limits = {"job_memory_bytes": 150_000_000, "job_file_bytes": 10_000}
    with installed(directory, service_hold, **limits) as started:
        yield started


@pytest.fixture
def plain(stack: Stack, client: Client, hold: Hold) -> Iterator[Installation]:
    """The session's service."""
    with connect_text(stack.redis_url) as connection:
        yield Installation(stack, client, Ledger(connection), hold)


@pytest.fixture(scope="module")
def small_ball() -> MeshFile:
    return MeshFile("small.obj", shapes.obj(*shapes.sphere(1)))


def test_a_job_out_of_time_is_a_timeout_and_not_tried_again(
    install: Install, rough_ball: MeshFile, ball: MeshFile
) -> None:
    installation = install(job_timeout=1)
    held = installation.hold.mesh(rough_ball)

    failed = installation.ended(installation.client.submit(held, ball, SMALL).id)

    assert failed.error is not None
    assert (failed.state, failed.attempt, failed.error.kind) == ("failed", 1, "timeout")


def test_a_job_out_of_memory_is_that_and_not_tried_again(
    confined: Installation, rough_ball: MeshFile, ball: MeshFile
) -> None:
    failed = confined.ended(confined.client.submit(rough_ball, ball, HUNGRY).id)

    assert failed.error is not None
    assert (failed.state, failed.attempt, failed.error.kind) == ("failed", 1, "memory")


def test_a_result_larger_than_may_be_stored_is_over_the_limit(
    confined: Installation, rough_ball: MeshFile, ball: MeshFile
) -> None:
    failed = confined.ended(confined.client.submit(rough_ball, ball, SMALL).id)

    assert failed.error is not None
    assert failed.error.kind == "limit"
    assert "MESHCONE_JOB_FILE_BYTES" in failed.error.message


def test_canceling_a_running_job_ends_its_horse_and_no_other_job(
    plain: Installation, rough_ball: MeshFile, ball: MeshFile, small_ball: MeshFile
) -> None:
    job_id, horse = plain.running(rough_ball, ball)
    next_id = plain.client.submit(small_ball, small_ball, SMALL).id

    plain.ledger.cancel(job_id)

    wait_for(lambda: has_ended(horse))
    assert plain.ended(job_id).state == "canceled"
    assert plain.ended(next_id).state == "succeeded"


def test_the_temporary_files_of_an_attempt_that_is_killed_are_removed(
    install: Install,
    rough_ball: MeshFile,
    ball: MeshFile,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    installation = install()
    job_id, _ = installation.running(rough_ball, ball)
    [place] = tmp_path.glob("meshcone-job-*")
    (place / "scene.usd").touch()

    installation.ledger.cancel(job_id)

    installation.ended(job_id)
    wait_for(lambda: not place.exists())


def test_those_of_a_worker_that_is_killed_are_removed_by_the_next_one(
    install: Install,
    rough_ball: MeshFile,
    ball: MeshFile,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    installation = install()
    installation.running(rough_ball, ball)
    [worker] = installation.stack.worker_pids()
    [place] = tmp_path.glob("meshcone-job-*")

    os.kill(worker, signal.SIGKILL)
    wait_for(lambda: has_ended(worker))
    assert place.exists()
    installation.stack.restart_ended()

    wait_for(lambda: not place.exists())


def test_a_worker_asked_to_stop_ends_the_job_in_hand_first(
    install: Install, rough_ball: MeshFile, ball: MeshFile
) -> None:
    installation = install(stop_grace=240)
    job_id, _ = installation.running(rough_ball, ball)
    [worker] = installation.stack.worker_pids()

    os.kill(worker, signal.SIGTERM)
    installation.hold.release()

    wait_for(lambda: has_ended(worker))
    assert installation.ledger.get(job_id).state == "succeeded"


def test_a_worker_out_of_grace_hands_its_job_back_and_no_attempt_is_counted(
    install: Install, rough_ball: MeshFile, ball: MeshFile
) -> None:
    installation = install(stop_grace=0)
    job_id, horse = installation.running(rough_ball, ball)
    [worker] = installation.stack.worker_pids()

    os.kill(worker, signal.SIGTERM)

    wait_for(lambda: has_ended(worker))
    assert has_ended(horse)
    handed_back = installation.ledger.get(job_id)
    assert (handed_back.state, handed_back.attempt, handed_back.handed_back) == ("queued", 1, 1)
    installation.stack.restart_ended()
    wait_for(lambda: installation.ledger.get(job_id).attempt == 2)
