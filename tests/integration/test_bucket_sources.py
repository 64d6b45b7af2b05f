"""Files of a bucket that the installation lets jobs name."""

from __future__ import annotations

import asyncio
import io
import urllib.request
from collections.abc import Iterator

import pytest

from meshcone.errors import InputError, LimitError
from tests.integration.object_store import object_store
from worker.transfers.buckets import Buckets
from worker.transfers.budget import Budget
from worker.transfers.errors import PassingError

MUG = b"v 0 0 0\n" * 100_000


@pytest.fixture(scope="module")
def bucket() -> Iterator[str]:
    """A bucket with a file, and the S3 client's own variables; its name."""
    with object_store("incoming") as store, pytest.MonkeyPatch.context() as environment:
        for name, value in store.environment.items():
            environment.setenv(name, value)
        environment.setenv("NO_PROXY", "*")
        direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        address = f"{store.environment['AWS_ENDPOINT_URL']}/incoming/meshes/mug.obj"
        headers = {"Content-Type": "model/obj"}
        direct.open(urllib.request.Request(address, MUG, headers, method="PUT")).close()  # noqa: S310
        yield "incoming"


def fetched(
    url: str, most: int = 1_000_000, allowed: tuple[str, ...] = ("s3://incoming",)
) -> bytes:
    into = io.BytesIO()
    asyncio.run(Buckets(allowed).fetch(url, into, Budget(most)))
    return into.getvalue()


def test_an_object_is_fetched(bucket: str) -> None:
    assert fetched(f"s3://{bucket}/meshes/mug.obj") == MUG
    assert fetched(f"s3://{bucket}/meshes/mug.obj", allowed=(f"s3://{bucket}/meshes",)) == MUG


def test_an_object_that_is_not_there_is_said(bucket: str) -> None:
    with pytest.raises(InputError, match="s3://incoming has no such object") as caught:
        fetched(f"s3://{bucket}/meshes/jug.obj")

    assert not isinstance(caught.value, PassingError)


def test_an_object_over_the_limit_is_refused(bucket: str) -> None:
    with pytest.raises(LimitError):
        fetched(f"s3://{bucket}/meshes/mug.obj", most=len(MUG) - 1)


def test_an_object_beside_what_is_allowed_is_not_read(bucket: str) -> None:
    with pytest.raises(InputError, match="MESHCONE_FETCH_BUCKETS"):
        fetched(f"s3://{bucket}/meshes/mug.obj", allowed=(f"s3://{bucket}/mesh",))


def test_a_bucket_that_does_not_answer_may_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    monkeypatch.setenv("AWS_ALLOW_HTTP", "true")
    monkeypatch.setenv("AWS_REGION", "us-east-1")
    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "tests")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "tests")

    with pytest.raises(PassingError, match="s3://nowhere cannot be read"):
        fetched("s3://nowhere/mug.obj", allowed=("s3://nowhere",))
