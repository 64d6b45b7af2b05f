"""Answers in JSON and text are compressed; everything else, and what is small, is not."""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import AsyncIterator
from urllib.parse import quote

import brotli
import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.testclient import TestClient

from service.api.middleware.compression import SMALLEST, Compression

LONG = json.dumps({"text": "mesh " * 1000}).encode()
TAG = '"abc"'


async def stored(request: Request) -> Response:
    """A file as the API sends it."""

    async def content() -> AsyncIterator[bytes]:
        for start in range(0, len(LONG), 100):
            yield LONG[start : start + 100]

    headers = {"ETag": TAG, "Content-Length": str(len(LONG)), "Accept-Ranges": "bytes"}
    media_type = request.query_params["type"]
    if request.method == "HEAD":
        return Response(headers=headers, media_type=media_type)
    return StreamingResponse(content(), headers=headers, media_type=media_type)


async def part(_request: Request) -> Response:
    headers = {"ETag": TAG, "Content-Range": f"bytes 0-1999/{len(LONG)}"}
    return Response(LONG[:2000], 206, headers, "application/json")


async def small(_request: Request) -> Response:
    return JSONResponse("a" * (SMALLEST - 2 - len('""')))


async def none(_request: Request) -> Response:
    return Response(b"", media_type="application/json")


async def events(_request: Request) -> Response:
    async def content() -> AsyncIterator[bytes]:
        yield b"data: " + b"a" * 2 * SMALLEST + b"\n\n"

    return StreamingResponse(content(), media_type="text/event-stream")


@pytest.fixture
def http() -> TestClient:
    app = Starlette(
        routes=[Route(f"/{each.__name__}", each) for each in (stored, part, small, none, events)]
    )
    return TestClient(Compression(app))


def received(http: TestClient, url: str, accept: str) -> tuple[dict[str, str], bytes]:
    """Headers, and the content as it went over the line."""
    with http.stream("GET", url, headers={"Accept-Encoding": accept}) as answer:
        return dict(answer.headers), b"".join(answer.iter_raw())


@pytest.mark.parametrize(
    "media_type", ["application/json", "application/problem+json", "text/csv", "text/plain"]
)
def test_json_and_text_are_compressed_as_the_client_likes(
    http: TestClient, media_type: str
) -> None:
    url = f"/stored?type={quote(media_type)}"

    headers, content = received(http, url, "gzip")
    assert (headers["content-encoding"], gzip.decompress(content)) == ("gzip", LONG)
    headers, content = received(http, url, "gzip, br")
    assert (headers["content-encoding"], brotli.decompress(content)) == ("br", LONG)
    headers, content = received(http, url, "identity")
    assert ("content-encoding" in headers, content) == (False, LONG)


def test_a_compressed_file_has_a_weak_tag_and_no_parts(http: TestClient) -> None:
    headers, content = received(http, "/stored?type=application/json", "gzip")

    assert headers["etag"] == f"W/{TAG}"
    assert "accept-ranges" not in headers
    assert "Accept-Encoding" in headers["vary"]
    assert "content-length" not in headers
    assert zlib.decompress(content, 31) == LONG


def test_a_file_that_is_not_compressed_keeps_its_tag_and_its_parts(http: TestClient) -> None:
    headers, _ = received(http, "/stored?type=application/json", "identity")

    assert (headers["etag"], headers["accept-ranges"]) == (TAG, "bytes")
    assert "Accept-Encoding" in headers["vary"]


@pytest.mark.parametrize(
    "media_type",
    ["model/gltf-binary", "model/gltf+json", "model/obj", "image/png", "application/zip"],
)
def test_meshes_pictures_and_archives_are_sent_as_they_are(
    http: TestClient, media_type: str
) -> None:
    headers, content = received(http, f"/stored?type={quote(media_type)}", "gzip, br")

    assert "content-encoding" not in headers
    assert (headers["etag"], content) == (TAG, LONG)


@pytest.mark.parametrize("accept", ["gzip", "br", "identity"])
@pytest.mark.parametrize(
    "url", ["/stored?type=application/json", "/stored?type=model/obj", "/part", "/small", "/none"]
)
def test_a_head_has_the_headers_of_a_get_and_no_content(
    http: TestClient, url: str, accept: str
) -> None:
    got, _ = received(http, url, accept)
    with http.stream("HEAD", url, headers={"Accept-Encoding": accept}) as asked:
        content = b"".join(asked.iter_raw())

    assert (dict(asked.headers), content) == (got, b"")


@pytest.mark.parametrize("url", ["/part", "/small", "/events"])
def test_parts_small_answers_and_events_are_sent_as_they_are(http: TestClient, url: str) -> None:
    headers, _ = received(http, url, "gzip, br")

    assert "content-encoding" not in headers
