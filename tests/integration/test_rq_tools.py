"""RQ's own commands and RQ's own worker, on an installation of ours."""

from __future__ import annotations

import os
import signal
import subprocess
import sysconfig
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest
from redis import Redis
from rq import Worker
from rq.command import send_stop_job_command
from rq.serializers import JSONSerializer

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests.holding import Hold
from tests.integration.restarted import restarted_stack
from tests.integration.sending import sent
from tests.integration.waiting import PATIENCE, wait_for
from worker.broker.connections import connect_bytes, connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.settings import WorkerSettings

SERIALIZER = "rq.serializers.JSONSerializer"


def rq(url: str, *command: str, environment: Mapping[str, str] | None = None) -> str:
    """What RQ's program says, in an environment with nothing of ours but what is given."""
    outer = {name: value for name, value in os.environ.items() if not name.startswith("MESHCONE_")}
    ended = subprocess.run(
        [Path(sysconfig.get_path("scripts")) / "rq", *command, "--url", url],
        env={**outer, **(environment or {})},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@dataclass
class Installation:
    """One worker, and jobs that can be held."""

    stack: Stack
    client: Client
    ledger: Ledger
    redis: Redis
    hold: Hold

    def running(self, source: MeshFile, reference: MeshFile) -> str:
        job_id = self.client.submit(self.hold.mesh(source), reference).id
        wait_for(lambda: self.ledger.get(job_id).progress is not None)
        return job_id

    def worker_state(self) -> str:
        [worker] = Worker.all(self.redis, serializer=JSONSerializer)
        return worker.get_state()

    def left_by_messages(self) -> set[bytes]:
        """RQ's keys, but for those of workers and the list of queues."""
        keys = set(self.redis.scan_iter("rq:*", count=1000))
        return {
            key for key in keys if not key.startswith((b"rq:worker", b"rq:queues", b"rq:clean"))
        }


@pytest.fixture(scope="module")
def installed(
    tmp_path_factory: pytest.TempPathFactory, service_hold: Hold
) -> Iterator[Installation]:
    """One for all tests: each takes it over with no job at work."""
    directory = tmp_path_factory.mktemp("rq")
    with ExitStack() as opened:
        settings = WorkerSettings(data_dir=directory)
        running = restarted_stack(settings, service_hold, workers=1, log=directory / "log")
        stack = opened.enter_context(running)
        client = opened.enter_context(Client(stack.url))
        text = opened.enter_context(connect_text(stack.redis_url))
        redis = opened.enter_context(connect_bytes(stack.redis_url))
        yield Installation(stack, client, Ledger(text), redis, service_hold)


@pytest.fixture
def installation(installed: Installation) -> Iterator[Installation]:
    yield installed
    installed.hold.release()
    jobs = installed.ledger.index
    wait_for(lambda: jobs.count("queued") + jobs.count("running") == 0)


def test_rq_info_shows_queue_and_worker_while_a_job_runs(
    installation: Installation, rough_ball: MeshFile, ball: MeshFile
) -> None:
    installation.running(rough_ball, ball)
    installation.client.submit(rough_ball, ball)

    shown = [
        line.split() for line in rq(installation.stack.redis_url, "info", "--raw").splitlines()
    ]

    [worker] = [line for line in shown if line[:1] == ["worker"]]
    assert ["queue", "meshcone", "1,"] in [line[:3] for line in shown]
    assert "busy" in worker
    assert "meshcone." in worker


def test_a_suspended_worker_takes_nothing_until_it_is_resumed(
    installation: Installation, rough_ball: MeshFile, ball: MeshFile
) -> None:
    url = installation.stack.redis_url
    rq(url, "suspend")
    wait_for(lambda: installation.worker_state() == "suspended")
    job = installation.client.submit(rough_ball, ball)
    assert installation.client.job(job.id).state == "queued"
    assert installation.worker_state() == "suspended"

    rq(url, "resume")

    assert installation.client.wait(job.id, timeout=PATIENCE).state == "succeeded"


def test_rqs_command_to_stop_a_job_cancels_it(
    installation: Installation, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job_id = installation.running(rough_ball, ball)
    [worker] = Worker.all(installation.redis, serializer=JSONSerializer)
    message = worker.get_current_job_id()
    assert message is not None

    send_stop_job_command(installation.redis, message, serializer=JSONSerializer)

    wait_for(lambda: installation.ledger.get(job_id).state == "canceled")


def test_a_job_that_has_ended_leaves_nothing_in_rqs_lists(
    installation: Installation, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = installation.client.submit(rough_ball, ball)

    installation.client.wait(job.id, timeout=PATIENCE)

    wait_for(lambda: not installation.left_by_messages())


def test_a_killed_worker_leaves_nothing_in_rqs_lists_that_stays(
    installation: Installation, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job_id = installation.running(rough_ball, ball)
    [worker] = installation.stack.worker_pids()

    os.kill(worker, signal.SIGKILL)
    wait_for(lambda: installation.ledger.get(job_id).attempt == 2, PATIENCE)
    installation.hold.release()
    installation.client.wait(job_id, timeout=PATIENCE)

    wait_for(
        lambda: all(installation.redis.ttl(key) != -1 for key in installation.left_by_messages())
    )


@pytest.fixture
def settings(tmp_path: Path) -> Iterator[WorkerSettings]:
    with EmbeddedBroker(tmp_path) as broker:
        yield WorkerSettings(data_dir=tmp_path, redis_url=broker.url)


@pytest.fixture
def ledger(settings: WorkerSettings) -> Iterator[Ledger]:
    with connect_text(settings.required_redis_url()) as client:
        yield Ledger(client)


def work_as_rq(settings: WorkerSettings, environment: Mapping[str, str]) -> None:
    """Have RQ's own worker work through the queue."""
    rq(
        settings.required_redis_url(),
        *("worker", settings.queue, "--burst", "--serializer", SERIALIZER),
        environment={"PYTHONPATH": str(Path.cwd()), **environment},
    )


def ours(settings: WorkerSettings) -> dict[str, str]:
    return {
        "MESHCONE_DATA_DIR": str(settings.data_dir),
        "MESHCONE_REDIS_URL": settings.required_redis_url(),
    }


def test_rqs_own_worker_finishes_a_job(settings: WorkerSettings, ledger: Ledger) -> None:
    job = sent(settings, ledger)

    work_as_rq(settings, ours(settings))

    done = ledger.get(job.id)
    assert (done.state, done.attempt) == ("succeeded", 1)
    assert set(done.artifacts) >= {"mesh", "report"}


def test_a_message_that_failed_in_rqs_own_worker_is_requeued_and_finishes(
    settings: WorkerSettings, ledger: Ledger
) -> None:
    job = sent(settings, ledger)
    work_as_rq(settings, {})  # which does not know the broker of its jobs
    with connect_bytes(settings.required_redis_url()) as connection:
        queue = JobQueue(settings, connection)
        assert queue.rq.failed_job_registry.count == 1

        requeue = ("requeue", "--queue", settings.queue, "--all", "--serializer", SERIALIZER)
        rq(settings.required_redis_url(), *requeue)
        assert queue.waiting() == {job.id}

        work_as_rq(settings, ours(settings))
        assert queue.rq.failed_job_registry.count == 0

    assert ledger.get(job.id).state == "succeeded"
