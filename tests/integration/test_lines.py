"""Jobs of several keys and projects: each has its turn, however many the first has sent."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence

import pytest
from redis import Redis
from rq.job import Job
from rq.serializers import JSONSerializer

from tests.integration.jobs import make_job
from worker.broker.connections import connect_async
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.errors import QueueFullError
from worker.jobs.fetch_accounts import FetchAccounts
from worker.jobs.heartbeats import Heartbeats
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import FETCHES
from worker.jobs.lines import WINDOW
from worker.jobs.project_scripts import PROJECT
from worker.jobs.queue import TASK, JobQueue, job_of
from worker.jobs.records import JobRecord, RemoteFile
from worker.outbound.shares import Shares
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister
from worker.transfers.fetching import Fetching
from worker.transfers.settings import TransferSettings
from worker.transfers.sources import Sources
from worker.upkeep.reconciler import Reconciler

MANY = 3 * WINDOW

Takes = Callable[..., list[list[str]]]


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: nothing else waits there."""
    return own_broker


def sent(ledger: Ledger, queue: JobQueue, count: int, owner: str, **fields: object) -> list[str]:
    """Jobs of a key, in the order in which they were accepted."""
    ids = []
    for _ in range(count):
        record = make_job().model_copy(update={"owner": owner, **fields})
        ledger.create(record)
        queue.enqueue(record.id)
        ids.append(record.id)
    return ids


def next_message(redis: Redis, queue: JobQueue) -> str | None:
    """What a worker would take, as it takes it; the id of its job."""
    message = redis.lpop(queue.rq.key)
    return None if message is None else job_of(str(message))


def run_all(redis: Redis, ledger: Ledger, queue: JobQueue) -> list[str]:
    """The jobs in the order in which one worker after another takes them up."""
    order = []
    while (job_id := next_message(redis, queue)) is not None:
        queue.release()
        ledger.begin(job_id)
        order.append(job_id)
    return order


def test_jobs_of_one_key_run_in_the_order_in_which_they_were_sent(
    redis: Redis, ledger: Ledger, queue: JobQueue
) -> None:
    ids = sent(ledger, queue, MANY, "ann")

    assert run_all(redis, ledger, queue) == ids


def test_jobs_of_two_keys_alternate_however_many_the_first_has_sent(
    redis: Redis, ledger: Ledger, queue: JobQueue
) -> None:
    first = sent(ledger, queue, MANY, "ann")
    second = sent(ledger, queue, WINDOW, "bob")

    order = run_all(redis, ledger, queue)

    is_second = [job_id in second for job_id in order[WINDOW : 3 * WINDOW]]
    assert order[:WINDOW] == first[:WINDOW]  # released before there was another
    assert is_second == [is_second[0], not is_second[0]] * WINDOW
    assert [job_id for job_id in order if job_id in second] == second
    assert sorted(order) == sorted(first + second)


def test_a_project_has_one_turn_however_many_keys_it_has(
    redis: Redis, ledger: Ledger, queue: JobQueue
) -> None:
    sent(ledger, queue, WINDOW, "zoe", project="before")
    for owner in ("ann", "bob", "cat"):
        sent(ledger, queue, WINDOW, owner, project="lamps")
    chairs = sent(ledger, queue, WINDOW, "dan", project="chairs")

    order = run_all(redis, ledger, queue)

    assert sum(job_id in chairs for job_id in order[WINDOW : 3 * WINDOW]) == WINDOW


def test_rqs_queue_holds_a_few_jobs_and_every_job_is_known_to_wait(
    redis: Redis, ledger: Ledger, queue: JobQueue
) -> None:
    ids = sent(ledger, queue, MANY, "ann")

    assert redis.llen(queue.rq.key) == WINDOW
    assert queue.waiting() == set(ids)


def test_a_message_is_one_as_rq_makes_them(redis: Redis, ledger: Ledger, queue: JobQueue) -> None:
    [job_id] = sent(ledger, queue, 1, "ann")

    [message] = redis.lrange(queue.rq.key, 0, -1)
    found = Job.fetch(str(message), queue.rq.connection, serializer=JSONSerializer)

    assert (found.func_name, found.args) == (TASK, [job_id])
    assert (found.get_status(), found.timeout, found.result_ttl) == ("queued", -1, 0)
    assert found.description == f"job {job_id}"
    assert queue.rq.job_ids == [found.id]


def test_a_canceled_job_leaves_its_line(redis: Redis, ledger: Ledger, queue: JobQueue) -> None:
    ids = sent(ledger, queue, MANY, "ann")

    for job_id in ids[WINDOW:-1]:
        ledger.cancel(job_id)

    assert queue.waiting() == {*ids[:WINDOW], ids[-1]}
    assert run_all(redis, ledger, queue) == [*ids[:WINDOW], ids[-1]]


def test_a_job_that_was_begun_before_goes_before_those_that_were_not(
    redis: Redis, ledger: Ledger, queue: JobQueue
) -> None:
    ids = sent(ledger, queue, MANY, "ann")
    taken = next_message(redis, queue)
    assert taken == ids[0]
    ledger.hand_back(taken, ledger.begin(taken))

    queue.enqueue(taken)

    assert run_all(redis, ledger, queue) == [*ids[1:WINDOW], taken, *ids[WINDOW:]]


def test_a_job_in_no_line_is_put_into_one_again_by_the_second_look(
    redis: Redis, ledger: Ledger, queue: JobQueue
) -> None:
    record = make_job()
    ledger.create(record)  # whoever should have lined it up has died
    reconciler = Reconciler(ledger, queue, Heartbeats(redis, 10.0), 3)

    reconciler.reconcile()
    assert queue.waiting() == set()
    reconciler.reconcile()

    assert run_all(redis, ledger, queue) == [record.id]


def test_a_release_that_was_missed_is_made_up_for_by_a_look(
    redis: Redis, ledger: Ledger, queue: JobQueue
) -> None:
    ids = sent(ledger, queue, MANY, "ann")
    for _ in range(WINDOW):  # workers that died before they released another
        ledger.begin(str(next_message(redis, queue)))
    reconciler = Reconciler(ledger, queue, Heartbeats(redis, 10.0), 3)

    reconciler.reconcile()

    assert run_all(redis, ledger, queue) == ids[WINDOW:]


def test_an_incomplete_job_waits_in_no_line_of_workers(ledger: Ledger, queue: JobQueue) -> None:
    remote = RemoteFile(name="mug.obj", url="https://assets.example.org/mug.obj")
    record = make_job().model_copy(update={"source": remote})
    ledger.create(record)

    queue.enqueue(record.id)

    assert queue.waiting() == set()


def test_jobs_are_known_whose_files_are_still_to_be_fetched(ledger: Ledger) -> None:
    remote = RemoteFile(name="mug.obj", url="https://assets.example.org/mug.obj")
    first, second, canceled = (make_job().model_copy(update={"source": remote}) for _ in range(3))
    for record in (first, second, canceled, make_job()):
        ledger.create(record)

    ledger.cancel(canceled.id)

    assert ledger.index.incomplete() == {first.id, second.id}


class TestFetching:
    """Whose files are fetched next."""

    REMOTE = RemoteFile(name="mug.obj", url="https://assets.example.org/mug.obj")

    @pytest.fixture
    def rounds(
        self, redis: Redis, ledger: Ledger, queue: JobQueue, broker: EmbeddedBroker
    ) -> Takes:
        """What a process takes, so many at a time, and sees to none of it."""

        async def takes(counts: Sequence[int]) -> list[list[str]]:
            settings = TransferSettings(redis_url=broker.url)
            blobs = BlobStore.open(settings, BlobRegister(redis))
            sources = Sources(settings, blobs, BlobRegister(redis), FetchAccounts(redis))
            async with connect_async(broker.url) as client:
                fetching = Fetching(client, settings, ledger=ledger, queue=queue, sources=sources)
                found = [await fetching.take(count) for count in counts]
                await sources.close()
            return [[taken.due.name for taken in round_] for round_ in found]

        return lambda *counts: asyncio.run(takes(counts))

    def wait(self, ledger: Ledger, count: int, project: str) -> list[str]:
        records = [
            make_job().model_copy(update={"source": self.REMOTE, "project": project})
            for _ in range(count)
        ]
        return [ledger.create(record) for record in records]

    def test_projects_alternate(self, ledger: Ledger, rounds: Takes) -> None:
        lamps, chairs = self.wait(ledger, 9, "lamps"), self.wait(ledger, 3, "chairs")

        [taken] = rounds(6)

        assert taken == [job_id for pair in zip(lamps[:3], chairs, strict=True) for job_id in pair]

    def test_no_project_takes_all_places_even_when_it_is_alone(
        self, ledger: Ledger, rounds: Takes
    ) -> None:
        lamps = self.wait(ledger, 20, "lamps")

        assert rounds(12, 3) == [lamps[:9], []]

    def test_what_is_due_again_waits_for_its_project_too(
        self, ledger: Ledger, redis: Redis, rounds: Takes
    ) -> None:
        lamps = self.wait(ledger, 12, "lamps")
        redis.zadd(FETCHES, dict.fromkeys(lamps, 0.0))
        chairs = self.wait(ledger, 1, "chairs")

        [taken] = rounds(12)

        assert set(chairs) < set(taken)
        assert len(taken) == 10

    def test_one_that_is_taken_is_given_to_nobody_else(self, ledger: Ledger, rounds: Takes) -> None:
        lamps = self.wait(ledger, 4, "lamps")

        assert [*rounds(3), *rounds(3)] == [lamps[:3], lamps[3:]]

    def test_a_canceled_one_is_not_fetched(self, ledger: Ledger, rounds: Takes) -> None:
        lamps = self.wait(ledger, 3, "lamps")
        ledger.cancel(lamps[1])

        assert rounds(3) == [[lamps[0], lamps[2]]]


class TestRoom:
    """How many jobs may be queued, and whose."""

    CAPACITY = 12

    def fill(self, ledger: Ledger, **fields: object) -> int:
        """Send jobs until no more are let in; how many were."""
        for count in range(100):
            record: JobRecord = make_job().model_copy(update=fields)
            try:
                ledger.create(record, capacity=self.CAPACITY)
            except QueueFullError:
                return count
        raise AssertionError("there is no end")

    def test_one_sender_fills_the_queue(self, ledger: Ledger) -> None:
        assert self.fill(ledger, owner="ann") == self.CAPACITY
        assert not ledger.index.has_room(self.CAPACITY, "default", "ann")

    def test_another_project_has_its_share_all_the_same(self, ledger: Ledger) -> None:
        self.fill(ledger, owner="ann", project="lamps")

        assert self.fill(ledger, owner="bob", project="chairs") == self.CAPACITY / 2
        assert self.fill(ledger, owner="cat", project="tables") == self.CAPACITY / 3
        assert self.fill(ledger, owner="ann", project="lamps") == 0

    def test_another_key_of_the_project_has_its_share_of_that(self, ledger: Ledger) -> None:
        self.fill(ledger, owner="ann")

        assert self.fill(ledger, owner="bob") == self.CAPACITY / 2
        assert self.fill(ledger, owner="ann") == 0

    def test_jobs_whose_files_are_somewhere_else_leave_room_for_others(
        self, ledger: Ledger
    ) -> None:
        remote = RemoteFile(name="mug.obj", url="https://assets.example.org/mug.obj")
        self.fill(ledger, owner="ann", source=remote)

        assert ledger.index.has_room(self.CAPACITY, "default", "bob")

    def test_room_that_is_left_comes_back(self, ledger: Ledger) -> None:
        record = make_job().model_copy(update={"id": new_job_id(), "owner": "ann"})
        ledger.create(record)
        self.fill(ledger, owner="ann")

        ledger.begin(record.id)

        assert self.fill(ledger, owner="ann") == 1

    def test_the_last_place_is_room_for_one_job(self, ledger: Ledger) -> None:
        for _ in range(self.CAPACITY - 1):
            ledger.create(make_job())

        assert ledger.index.has_room(self.CAPACITY, "default", None)

    def test_several_jobs_need_room_for_all_of_them(self, ledger: Ledger) -> None:
        ledger.create(make_job())

        assert ledger.index.has_room(self.CAPACITY, "default", None, self.CAPACITY - 1)
        assert not ledger.index.has_room(self.CAPACITY, "default", None, self.CAPACITY)


def test_of_what_is_due_no_project_takes_all_places(
    ledger: Ledger, redis: Redis, broker: EmbeddedBroker
) -> None:
    def due_of(project: str, count: int) -> list[str]:
        jobs = [make_job().model_copy(update={"project": project}) for _ in range(count)]
        names = [f"{ledger.create(job)}/report" for job in jobs]
        redis.zadd("times", dict.fromkeys(names, 0 if project == "lamps" else 1))
        return sorted(names)

    lamps, chairs = due_of("lamps", 5), due_of("chairs", 1)

    async def takes() -> list[list[str]]:
        async with connect_async(broker.url) as client:
            shares = Shares(client, "times", "tries", PROJECT, most=3)
            first, second = await shares.take(4), await shares.take(4)
            shares.release(lamps[0])
            third = await shares.take(4)
        return [[due.name for due in round_] for round_ in (first, second, third)]

    assert asyncio.run(takes()) == [lamps[:3] + chairs, [], lamps[3:4]]
