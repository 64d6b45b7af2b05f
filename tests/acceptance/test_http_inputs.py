"""Having again what was sent."""

from __future__ import annotations

from collections.abc import Iterator

import httpx2
import pytest

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from service.stack import Stack
from tests import shapes
from tests.holding import Hold

BEFORE = b"# Sent as it is.\r\n"


@pytest.fixture
def http(stack: Stack) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as client:
        yield client


@pytest.fixture(scope="module")
def pair(ball: MeshFile) -> tuple[MeshFile, MeshFile, MeshFile]:
    """A glTF with a buffer in a folder, an OBJ with line ends of its own, and a file for both."""
    vertices, faces = shapes.sphere(1)
    document, buffer = shapes.gltf(vertices, faces, "mug%20%C3%A4/data.bin")
    source = MeshFile("mug ü.gltf", document, {"mug ä/data.bin": buffer})
    return source, MeshFile("ball.obj", BEFORE + ball.data), MeshFile("notes.txt", b"\0\1\2")


@pytest.fixture(scope="module")
def measured(stack: Stack, pair: tuple[MeshFile, MeshFile, MeshFile]) -> Job:
    source, reference, note = pair
    with Client(stack.url) as client:
        options = {"mode": "measure"}
        return client.wait(client.submit(source, reference, options, resources=[note]).id)


def test_both_meshes_come_back_byte_for_byte_under_their_names(
    http: httpx2.Client, measured: Job, pair: tuple[MeshFile, MeshFile, MeshFile]
) -> None:
    source = http.get(f"/v1/jobs/{measured.id}/source")
    reference = http.get(f"/v1/jobs/{measured.id}/reference")

    assert source.content == pair[0].data
    assert "filename*=UTF-8''mug%20%C3%BC.gltf" in source.headers["content-disposition"]
    assert source.headers["content-type"] == "model/gltf+json"
    assert reference.content == pair[1].data
    assert 'filename="ball.obj"' in reference.headers["content-disposition"]
    assert reference.headers["etag"] == f'"{measured.reference.sha256}"'  # type: ignore[union-attr]


def test_a_job_says_where_each_file_it_was_sent_is(
    http: httpx2.Client, measured: Job, pair: tuple[MeshFile, MeshFile, MeshFile]
) -> None:
    [buffer], [note] = measured.source_resources, measured.resources

    assert buffer.link == f"/v1/jobs/{measured.id}/source_resources/mug%20%C3%A4/data.bin"
    assert http.get(buffer.link).content == pair[0].resources["mug ä/data.bin"]
    assert http.get(str(note.link)).content == pair[2].data
    assert http.get(str(measured.source.link)).content == pair[0].data


def test_an_input_comes_in_parts_and_not_again(http: httpx2.Client, measured: Job) -> None:
    path = str(measured.source.link)
    whole = http.get(path)

    part = http.get(path, headers={"Range": "bytes=4-9", "If-Range": whole.headers["etag"]})
    again = http.get(path, headers={"If-None-Match": whole.headers["etag"]})
    asked = http.head(path)

    assert (part.status_code, part.content) == (206, whole.content[4:10])
    assert (again.status_code, again.content) == (304, b"")
    assert (asked.status_code, asked.headers["etag"]) == (200, whole.headers["etag"])
    assert int(asked.headers["content-length"]) == len(whole.content)


def test_what_was_not_sent_is_not_there(
    http: httpx2.Client, client: Client, ball: MeshFile
) -> None:
    alone = client.wait(client.submit(ball, options={"mode": "audit"}).id)

    assert http.get(f"/v1/jobs/{alone.id}/reference").status_code == 404
    for side in ("source_resources", "reference_resources", "resources"):
        assert http.get(f"/v1/jobs/{alone.id}/{side}/{ball.name}").status_code == 404


def test_a_job_that_has_not_ended_has_its_inputs(
    http: httpx2.Client, client: Client, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    held = hold.mesh(rough_ball)
    job = client.submit(held, ball)

    assert http.get(f"/v1/jobs/{job.id}/source").content == held.data


def test_the_client_fetches_them(
    client: Client, measured: Job, pair: tuple[MeshFile, MeshFile, MeshFile]
) -> None:
    assert client.input(measured.source) == pair[0].data
    assert client.input(measured.resources[0]) == pair[2].data
