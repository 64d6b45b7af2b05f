"""Bytes of stored files that have changed since they were stored."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from service.stack import Stack
from tests.holding import Hold
from tests.integration.waiting import PATIENCE
from worker.jobs.identifiers import new_job_id


@pytest.fixture
def http(stack: Stack) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as connected:
        yield connected


def damage(data_dir: Path, digest: str) -> None:
    """Flip a bit of a stored file."""
    [path] = [path for path in (data_dir / "blobs").rglob("*") if path.name.startswith(digest)]
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def of_its_own(mesh: MeshFile) -> MeshFile:
    return MeshFile(mesh.name, mesh.data + f"# {new_job_id()}\n".encode())


def test_a_job_fails_over_a_damaged_input_and_sending_it_again_heals_it(
    client: Client, data_dir: Path, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    source = of_its_own(rough_ball)
    held = client.submit(hold.mesh(rough_ball), ball)
    job = client.submit(source, ball)
    damage(data_dir, source.sha256)
    hold.release()

    failed = client.wait(job.id, timeout=PATIENCE)
    client.wait(held.id, timeout=PATIENCE)

    assert failed.error is not None
    assert (failed.error.kind, failed.error.file) == ("internal", "rough.obj")
    assert "is damaged and has been set aside; send it again" in failed.error.detail
    assert client.wait(client.submit(source, ball).id, timeout=PATIENCE).state == "succeeded"


def test_a_damaged_result_is_never_served(
    client: Client, http: httpx2.Client, data_dir: Path, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = client.wait(client.submit(of_its_own(rough_ball), ball).id, timeout=PATIENCE)
    damage(data_dir, tag_of(http, job))

    head = http.head(f"/v1/jobs/{job.id}/mesh")
    answer = http.get(f"/v1/jobs/{job.id}/mesh")

    assert (head.status_code, answer.status_code) == (500, 500)
    assert answer.headers["content-type"] == "application/problem+json"
    assert "damaged and has been set aside" in answer.json()["detail"]


def test_a_damaged_upload_counts_as_not_sent(
    http: httpx2.Client, data_dir: Path, rough_ball: MeshFile
) -> None:
    mesh = of_its_own(rough_ball)
    place = f"/v1/blobs/{mesh.sha256}"
    assert http.put(place, content=mesh.data).status_code == 201
    damage(data_dir, mesh.sha256)

    assert http.head(place).status_code == 404
    assert http.put(place, content=mesh.data).status_code == 201
    assert http.head(place).status_code == 200


def tag_of(http: httpx2.Client, job: Job) -> str:
    return str(http.head(f"/v1/jobs/{job.id}/mesh").headers["etag"]).removeprefix("W/").strip('"')
