"""The files of a job, fetched by the process that does so, into a store without workers."""

from __future__ import annotations

import hashlib
import io
import json
from pathlib import Path

import pytest
from redis import Redis

from tests.integration.file_server import Answer, FileServer
from tests.integration.jobs import make_job
from tests.integration.transferring import MUG, Transfer, ended_fetching, remote_job
from tests.integration.waiting import wait_for
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.errors import TransitionRefusedError
from worker.jobs.fetch_accounts import FetchAccounts
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import FETCH_TRIES, FETCHES
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobProgress, RemoteFile, StoredFile
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister
from worker.transfers.settings import TransferSettings
from worker.transfers.sources import Sources


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: what is due in one is fetched in no other."""
    return own_broker


def versions(settings: WorkerSettings) -> list[tuple[int, int]]:
    """What tells the files of the store from any that are written later."""
    found = [place.stat() for place in settings.data_dir.glob("blobs/**/*") if place.is_file()]
    return sorted((stat.st_ino, stat.st_mtime_ns) for stat in found)


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
