"""`meshcone serve` on a disk that fills up."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from meshcone.files import MeshFile
from service.client import Client
from tests.calling import Caller, Form, small_form
from tests.holding import Hold
from tests.integration.waiting import wait_for
from tests.serving import Service, starting

# A mount of the service's own, which ends with it and needs no rights on this machine.
SMALL_DISK = (
    *("unshare", "--map-root-user", "--mount"),
    *("sh", "-c", 'mount -t tmpfs -o size=24m none "$0" && exec "$@"'),
)


@pytest.fixture(scope="module")
def pair() -> Form:
    return small_form()


def test_a_full_disk_is_said_and_all_goes_on_when_it_has_room(tmp_path: Path, pair: Form) -> None:
    data_dir = tmp_path / "meshcone-data"
    data_dir.mkdir()
    with (
        starting(tmp_path, within=[*SMALL_DISK, str(data_dir)]) as service,
        Caller(service.url()) as caller,
    ):
        assert caller.submit(pair).status_code == 202
        wait_for(caller.has_seen_all_end)
        with full(inside(service, data_dir)):
            wait_for(lambda: "full" in caller.submit(pair).json().get("detail", ""))
            wait_for(lambda: "full" in caller.readiness()[1])
            unsent = caller.submit(with_other_content(pair))
            assert (unsent.status_code, "full" in unsent.json()["detail"]) == (503, True)
            caller.look()
            wait_for(lambda: "broker cannot be started: the disk of" in service.log.read_text())
            assert service.process.poll() is None

        wait_for(lambda: caller.submit(pair).status_code == 202)
        wait_for(caller.has_seen_all_end)
        assert {caller.state(caller.accepted[each]) for each in (0, -1)} == {"succeeded"}
        assert set(caller.alive) == {200}
        assert set(caller.statuses) <= {200, 202, 503}


def test_a_job_whose_results_find_no_room_waits_and_no_attempt_is_counted(
    tmp_path: Path, ball: MeshFile, rough_ball: MeshFile, hold: Hold
) -> None:
    files = tmp_path / "files"
    files.mkdir()
    elsewhere = {"MESHCONE_BLOB_URL": files.as_uri(), "MESHCONE_ATTEMPTS": "1"}
    with (
        starting(
            tmp_path, within=[*SMALL_DISK, str(files)], **hold.environment(), **elsewhere
        ) as service,
        Client(service.url()) as client,
    ):
        job = client.submit(hold.mesh(rough_ball), ball)
        wait_for(lambda: client.job(job.id).state == "running")
        with full(inside(service, files)):
            hold.release()
            wait_for(lambda: f"job {job.id} waits" in service.log.read_text(), 120)
            assert client.job(job.id).state in {"queued", "running"}

        wait_for(lambda: client.job(job.id).state == "succeeded", 120)


def with_other_content(pair: Form) -> Form:
    """The same meshes as files that the service does not have yet."""
    return {side: (name, data + b"# another\n") for side, (name, data) in pair.items()}


def inside(service: Service, path: Path) -> Path:
    """A path as the service sees it, whose mounts are its own."""
    return Path(f"/proc/{service.process.pid}/root{path}")


@contextmanager
def full(directory: Path) -> Iterator[None]:
    """Leave no byte of room on a disk for a while."""
    filler = directory / "filler"
    with filler.open("wb") as file:
        for _ in range(1000):
            free = shutil.disk_usage(directory).free
            if not free:
                break
            with suppress(OSError):  # the service has written meanwhile
                os.posix_fallocate(file.fileno(), 0, os.fstat(file.fileno()).st_size + free)
    try:
        yield
    finally:
        filler.unlink()
