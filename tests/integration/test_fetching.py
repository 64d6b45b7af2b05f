"""The files of a job, fetched by the process that does so, into a store without workers."""

from __future__ import annotations

import asyncio
import hashlib
import io
import json
import subprocess
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path

import pytest
from redis import Redis

from tests.integration.file_server import Answer, FileServer
from tests.integration.jobs import make_job
from tests.integration.transferring import transferring
from tests.integration.waiting import wait_for
from worker.broker.connections import connect_async
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.errors import TransitionRefusedError
from worker.jobs.fetch_accounts import FetchAccounts
from worker.jobs.heartbeats import Heartbeats
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import FETCH_TRIES, FETCHES
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobProgress, JobRecord, RemoteFile, StoredFile
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.errors import StoreFullError
from worker.storage.register import BlobRegister
from worker.transfers.fetching import Fetching
from worker.transfers.settings import TransferSettings
from worker.transfers.sources import Sources
from worker.upkeep.reconciler import Reconciler

MUG = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

Transfer = Callable[..., AbstractContextManager["subprocess.Popen[bytes]"]]


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: what is due in one is fetched in no other."""
    return own_broker


@pytest.fixture
def transfer(settings: WorkerSettings) -> Transfer:
    """Runs the process while a block is worked through."""

    return partial(transferring, settings)


def remote_job(ledger: Ledger, source: str | RemoteFile, **more: object) -> JobRecord:
    """An incomplete job in the ledger, whose source is at a URL, and which has no reference."""
    file = RemoteFile(name="mug.obj", url=source) if isinstance(source, str) else source
    fields = {"source": file, "reference": None, "progress": JobProgress.fetching(), **more}
    record = make_job().model_copy(update=fields)
    ledger.create(record)
    return record


def versions(settings: WorkerSettings) -> list[tuple[int, int]]:
    """What tells the files of the store from any that are written later."""
    found = [place.stat() for place in settings.data_dir.glob("blobs/**/*") if place.is_file()]
    return sorted((stat.st_ino, stat.st_mtime_ns) for stat in found)


def ended_fetching(redis: Redis, job: JobRecord) -> bool:
    return redis.zscore(FETCHES, job.id) is None


def test_a_job_waits_for_its_files_and_is_queued_with_their_hashes(
    ledger: Ledger,
    redis: Redis,
    queue: JobQueue,
    blobs: BlobStore,
    server: FileServer,
    transfer: Transfer,
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", MUG) + "?token=3f9a")
    assert ledger.get(job.id).progress == JobProgress.fetching()
    with pytest.raises(TransitionRefusedError):
        ledger.begin(job.id)

    with transfer():
        wait_for(lambda: queue.waiting() == {job.id})

    digest = hashlib.sha256(MUG).hexdigest()
    complete = ledger.get(job.id)
    assert complete.source == StoredFile(
        name="mug.obj", digest=digest, size=len(MUG), origin=f"{server.url}/mug.obj"
    )
    assert (complete.state, complete.progress) == ("queued", None)
    assert blobs.get(digest) == MUG
    assert server.seen[0].path == "/mug.obj?token=3f9a"
    assert "3f9a" not in str(redis.hgetall(f"meshcone:job:{job.id}"))
    assert not redis.exists(FETCHES, FETCH_TRIES)
    assert ledger.begin(job.id) == 1


def test_what_fails_in_passing_is_tried_again(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, f"{server.url}/mug.obj")
    server.answers["/mug.obj"] = [Answer(status=503), Answer(status=500), Answer(MUG)]

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    assert len(server.seen) == 3
    assert isinstance(ledger.get(job.id).source, StoredFile)


def test_what_fails_for_good_fails_the_job_in_words_without_the_query(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer, tmp_path: Path
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", b"", status=404) + "?token=3f9a")

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    failed = ledger.get(job.id)
    assert failed.error is not None
    assert (failed.state, failed.attempt, failed.error.kind) == ("failed", 0, "input")
    assert failed.error.file == "mug.obj"
    assert "127.0.0.1 answered 404" in failed.error.message
    assert len(server.seen) == 1
    assert "3f9a" not in (tmp_path / "transfers.log").read_text()


def test_what_goes_on_failing_fails_the_job_after_its_attempts(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", b"", status=503))

    with transfer(MESHCONE_FETCH_ATTEMPTS="3"):
        wait_for(lambda: ended_fetching(redis, job))

    error = ledger.get(job.id).error
    assert error is not None
    assert error.message.endswith("it was tried 3 times")
    assert len(server.seen) == 3


def test_other_bytes_than_the_sender_named_fail_the_job(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    file = RemoteFile(name="mug.obj", url=server.has("/mug.obj", MUG), sha256="0" * 64)
    job = remote_job(ledger, file)

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    error = ledger.get(job.id).error
    assert error is not None
    assert hashlib.sha256(MUG).hexdigest() in error.message


def test_a_body_that_comes_too_slowly_fails_the_job(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", b"v", endless=True, pause=0.05))

    with transfer(MESHCONE_FETCH_SECONDS="0.3", MESHCONE_FETCH_ATTEMPTS="1"):
        wait_for(lambda: ended_fetching(redis, job))

    error = ledger.get(job.id).error
    assert error is not None
    assert "MESHCONE_FETCH_SECONDS" in error.message


def test_a_named_secret_is_sent_to_its_host(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    file = RemoteFile(name="mug.obj", url=server.has("/mug.obj", MUG), authorization="cdn")
    job = remote_job(ledger, file)
    secrets = {"cdn": {"host": server.url, "value": "Bearer 3f9a"}}

    with transfer(MESHCONE_TRANSFER_AUTHORIZATIONS=json.dumps(secrets)):
        wait_for(lambda: ended_fetching(redis, job))

    assert server.seen[0].headers["authorization"] == "Bearer 3f9a"
    assert ledger.get(job.id).state == "queued"


def test_what_a_gltf_names_comes_from_its_folder_where_that_is_asked_for(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    uris = ["data/a%20b.bin", "sent.bin", "../secret.bin", "http://127.0.0.1/x.bin", "/y.bin"]
    gltf = json.dumps({"buffers": [{"uri": uri} for uri in uris]}).encode()
    server.has("/assets/data/a%20b.bin", b"buffer")
    server.has("/assets/sent.bin", b"from the server")
    sent = RemoteFile(name="sent.bin", url=server.has("/elsewhere", b"as it was named"))
    mesh = RemoteFile(
        name="mug.gltf", url=server.has("/assets/mug.gltf", gltf), resources="relative"
    )
    job = remote_job(ledger, mesh, source_resources=(sent,))

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    complete = ledger.get(job.id)
    assert [file.name for file in complete.source_resources] == ["sent.bin", "data/a b.bin"]
    assert sorted(server.paths()) == ["/assets/data/a%20b.bin", "/assets/mug.gltf", "/elsewhere"]


def test_what_gltfs_name_counts_as_resources_of_the_job(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    gltf = json.dumps({"buffers": [{"uri": "a.bin"}, {"uri": "b.bin"}]}).encode()
    meshes = [
        RemoteFile(name=name, url=server.has(f"/{name}", gltf), resources="relative")
        for name in ("mug.gltf", "other.gltf")
    ]
    for name in ("/a.bin", "/b.bin"):
        server.has(name, b"buffer")
    job = remote_job(ledger, meshes[0], reference=meshes[1])

    with transfer(MESHCONE_MAX_RESOURCES="3"):
        wait_for(lambda: ended_fetching(redis, job))

    error = ledger.get(job.id).error
    assert error is not None
    assert (error.kind, error.file) == ("limit", "other.gltf")
    assert "names 2 more files, and the job may have 1 more" in error.message
    assert server.paths().count("/a.bin") == 1


def test_only_a_file_that_the_project_has_is_not_written_again(
    settings: WorkerSettings, redis: Redis, blobs: BlobStore
) -> None:
    register = BlobRegister(redis)
    sources = Sources(TransferSettings(), blobs, register, FetchAccounts(redis))
    file = RemoteFile(name="mug.obj", url="https://example.org/mug.obj")

    def is_written_for(project: str) -> bool:
        before = versions(settings)
        sources.keep(file, io.BytesIO(MUG), make_job().model_copy(update={"project": project}))
        return versions(settings) != before

    assert is_written_for("chairs")
    assert is_written_for("lamps")
    register.lease_upload(hashlib.sha256(MUG).hexdigest(), "lamps", 60)
    assert not is_written_for("lamps")


def test_a_gltf_that_nobody_asked_it_for_has_nothing_fetched_beside_it(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    gltf = json.dumps({"buffers": [{"uri": "a.bin"}]}).encode()
    job = remote_job(ledger, server.has("/mug.gltf", gltf))

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    assert server.paths() == ["/mug.gltf"]


def test_all_files_of_a_job_share_one_limit(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    other = RemoteFile(name="other.obj", url=server.has("/other.obj", MUG))
    job = remote_job(ledger, server.has("/mug.obj", MUG), reference=other)

    with transfer(MESHCONE_FETCH_BYTES=str(2 * len(MUG) - 1)):
        wait_for(lambda: ended_fetching(redis, job))

    error = ledger.get(job.id).error
    assert error is not None
    assert error.kind == "limit"


def test_a_job_canceled_while_its_files_come_ends_at_once(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", b"v", endless=True, pause=0.05))
    with transfer():
        wait_for(lambda: server.seen)

        assert ledger.cancel(job.id) == "canceled"

        following = remote_job(ledger, server.has("/next.obj", MUG))
        wait_for(lambda: ended_fetching(redis, following))
    assert ledger.get(job.id).state == "canceled"


def test_files_in_hand_are_left_to_the_next_process_and_the_try_is_not_counted(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", b"v", endless=True, pause=0.05))
    with transfer():
        wait_for(lambda: server.seen)
    assert redis.hget(FETCH_TRIES, job.id) == "0"
    server.has("/mug.obj", MUG)

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    assert ledger.get(job.id).state == "queued"


def test_files_in_the_hand_of_a_process_that_died_are_fetched_by_the_next(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", b"v", endless=True, pause=0.05))
    with transfer() as process:
        wait_for(lambda: server.seen)
        process.kill()
    server.has("/mug.obj", MUG)
    redis.zadd(FETCHES, {job.id: 0})  # as when the time it was taken for is over

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    assert ledger.get(job.id).state == "queued"


def test_fetching_that_ends_every_process_is_given_up(
    ledger: Ledger, redis: Redis, server: FileServer, transfer: Transfer
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", MUG))
    redis.hset(FETCH_TRIES, job.id, 10)  # begun twice as often as it may be tried

    with transfer():
        wait_for(lambda: ended_fetching(redis, job))

    error = ledger.get(job.id).error
    assert error is not None
    assert (error.kind, server.seen) == ("internal", [])


def test_no_message_is_sent_of_a_job_that_still_waits_for_files(
    ledger: Ledger, redis: Redis, queue: JobQueue
) -> None:
    remote_job(ledger, "https://example.org/mug.obj")
    lost = make_job()
    ledger.create(lost)
    reconciler = Reconciler(ledger, queue, Heartbeats(redis, 10.0), 3)

    reconciler.reconcile()
    reconciler.reconcile()

    assert queue.waiting() == {lost.id}


class _NoRoom(Sources):
    """A disk without room for what is fetched."""

    async def complete(self, _record: JobRecord) -> JobRecord:
        raise StoreFullError


def test_a_disk_without_room_is_waited_for_and_is_no_try(
    ledger: Ledger,
    redis: Redis,
    settings: WorkerSettings,
    blobs: BlobStore,
    queue: JobQueue,
    server: FileServer,
) -> None:
    job = remote_job(ledger, server.has("/mug.obj", MUG))
    transfers = TransferSettings(**settings.model_dump(), fetch_attempts=1)

    async def until_it_waits() -> None:
        async with connect_async(settings.required_redis_url()) as client:
            sources = _NoRoom(transfers, blobs, BlobRegister(redis), FetchAccounts(redis))
            fetching = Fetching(client, transfers, ledger=ledger, queue=queue, sources=sources)
            running = asyncio.create_task(fetching.run())
            while redis.hget(FETCH_TRIES, job.id) != "0":
                await asyncio.sleep(0.01)
            fetching.stop()
            await running

    asyncio.run(asyncio.wait_for(until_it_waits(), 60))

    assert ledger.get(job.id).state == "queued"
    assert redis.zscore(FETCHES, job.id) is not None
