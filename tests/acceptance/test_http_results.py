"""Fetching results: again, in part, and to look at."""

from __future__ import annotations

import io
from collections.abc import Iterator

import httpx2
import numpy as np
import pytest
from PIL import Image

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from service.stack import Stack
from tests.painted import encoded, painted, picture

FILES = [
    "mesh", "report", "certificate", "preview.glb", "heatmap.glb", "diagnostics.csv",
    "thumbnail.webp",
]  # fmt: skip


@pytest.fixture
def http(stack: Stack) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as client:
        yield client


@pytest.fixture(scope="module")
def finished(stack: Stack, rough_ball: MeshFile, ball: MeshFile) -> Job:
    with Client(stack.url) as client:
        return client.wait(client.submit(rough_ball, ball).id)


@pytest.mark.parametrize("name", [*FILES, "diagnostics"])
def test_a_current_copy_is_not_sent_again(http: httpx2.Client, finished: Job, name: str) -> None:
    path = f"/v1/jobs/{finished.id}/{name}"
    sent = http.get(path).headers["etag"]  # a weak one where the file came compressed
    tag = sent.removeprefix("W/")

    for known in (sent, tag, f'"other", W/{tag}', "*"):
        answer = http.get(path, headers={"If-None-Match": known})
        assert (answer.status_code, answer.content) == (304, b"")
        assert answer.headers["etag"] == tag
    assert http.get(path, headers={"If-None-Match": '"other"'}).status_code == 200


@pytest.mark.parametrize("name", FILES)
def test_a_file_comes_in_parts(http: httpx2.Client, finished: Job, name: str) -> None:
    path = f"/v1/jobs/{finished.id}/{name}"
    whole = http.get(path).content
    size = len(whole)

    parts = [
        http.get(path, headers={"Range": span})
        for span in ("bytes=0-9", f"bytes=10-{size - 11}", "bytes=-10")
    ]

    assert [part.status_code for part in parts] == [206, 206, 206]
    assert b"".join(part.content for part in parts) == whole
    assert parts[1].headers["content-range"] == f"bytes 10-{size - 11}/{size}"


def test_a_part_that_is_not_there_is_a_problem_that_says_how_much_there_is(
    http: httpx2.Client, finished: Job
) -> None:
    path = f"/v1/jobs/{finished.id}/mesh"
    size = len(http.get(path).content)

    answer = http.get(path, headers={"Range": f"bytes={size}-"})

    assert answer.status_code == 416
    assert answer.headers["content-range"] == f"bytes */{size}"
    assert answer.json()["type"] == "urn:meshcone:problem:range"


@pytest.mark.parametrize(
    "span", ["bytes=0-1,4-5", "lines=1-2", "bytes=5-2", "bytes=-", "bytes=a-b"]
)
def test_a_range_that_cannot_be_read_is_ignored(
    http: httpx2.Client, finished: Job, span: str
) -> None:
    answer = http.get(f"/v1/jobs/{finished.id}/mesh", headers={"Range": span})

    assert answer.status_code == 200


def test_a_part_of_another_file_is_answered_with_the_whole(
    http: httpx2.Client, finished: Job
) -> None:
    path = f"/v1/jobs/{finished.id}/mesh"
    tag = http.get(path).headers["etag"]

    same = http.get(path, headers={"Range": "bytes=0-9", "If-Range": tag})
    other = http.get(path, headers={"Range": "bytes=0-9", "If-Range": '"other"'})

    assert (same.status_code, other.status_code) == (206, 200)


def test_a_head_says_how_large_a_file_is(http: httpx2.Client, finished: Job) -> None:
    path = f"/v1/jobs/{finished.id}/mesh"

    answer = http.head(path, headers={"Range": "bytes=0-9"})  # which only a GET may ask for

    assert (answer.status_code, answer.content) == (200, b"")
    assert int(answer.headers["content-length"]) == len(http.get(path).content)
    assert answer.headers["accept-ranges"] == "bytes"


def test_the_heatmap_is_the_refined_mesh(http: httpx2.Client, finished: Job) -> None:
    links = finished.links
    answer = http.get(f"/v1/jobs/{finished.id}/heatmap.glb")

    heatmap = read_asset("heatmap.glb", answer.content)
    refined = read_asset("refined.obj", http.get(str(links.mesh)).content)
    assert links.heatmap == f"/v1/jobs/{finished.id}/heatmap.glb"
    assert answer.headers["content-type"] == "model/gltf-binary"
    assert np.abs(heatmap.vertices - refined.vertices).max() < 1e-6


def test_a_measurement_has_a_heatmap_too(
    http: httpx2.Client, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = client.wait(client.submit(rough_ball, ball, {"mode": "measure"}).id)

    assert http.get(str(job.links.heatmap)).content[:4] == b"glTF"


def test_a_job_leaves_a_small_picture(client: Client, finished: Job) -> None:
    picture = Image.open(io.BytesIO(client.thumbnail(finished.id)))

    assert (picture.format, picture.size) == ("WEBP", (112, 112))


def test_coloured_files_are_pictured_from_six_sides(http: httpx2.Client, stack: Stack) -> None:
    file = MeshFile("globe.gltf", painted(encoded(picture())))
    with Client(stack.url) as client:
        job = client.wait(client.submit(file, file, {"mode": "measure"}).id)

        pictures = client.pictures(job.id)
        report = client.report(job.id)

    answer = http.get(f"/v1/jobs/{job.id}/pictures.png")
    assert answer.headers["content-type"] == "image/png"
    assert answer.content == pictures
    assert report["appearance"]["color_difference"]["p95"] < 1e-6


def test_files_without_colours_have_no_pictures(http: httpx2.Client, finished: Job) -> None:
    answer = http.get(f"/v1/jobs/{finished.id}/pictures.png")

    assert finished.links.pictures is None
    assert answer.status_code == 404
    assert "neither file has colours" in answer.json()["detail"]
