"""An S3 on this machine: moto's server, in a process of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

START_TIMEOUT = 60.0  # seconds


@dataclass(frozen=True)
class ObjectStore:
    """A bucket.

    Attributes:
        url: what an installation is told.
        environment: what the S3 client is told, by its own variables.
    """

    url: str
    environment: Mapping[str, str]


@contextmanager
def object_store(bucket: str = "meshes") -> Iterator[ObjectStore]:
    """A server with one empty bucket, while the body runs."""
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", "moto.server", "-H", "127.0.0.1", "-p", "0"],
        env={**os.environ, "NO_PROXY": "*", "no_proxy": "*"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    watchdog = threading.Timer(START_TIMEOUT, process.kill)
    watchdog.start()
    try:
        endpoint = _endpoint(process)
        watchdog.cancel()
        _read_on(process)
        direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        direct.open(urllib.request.Request(f"{endpoint}/{bucket}", method="PUT")).close()  # noqa: S310
        yield ObjectStore(
            url=f"s3://{bucket}/some/prefix",
            environment={
                "AWS_ENDPOINT_URL": endpoint,
                "AWS_ALLOW_HTTP": "true",
                "AWS_REGION": "us-east-1",
                "AWS_ACCESS_KEY_ID": "tests",
                "AWS_SECRET_ACCESS_KEY": "tests",
            },
        )
    finally:
        watchdog.cancel()
        process.terminate()
        process.wait(20)


def _endpoint(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    for line in process.stdout:
        found = re.search(r"Running on (http://\S+)", line)
        if found:
            return found[1]
    raise AssertionError("the S3 server did not start")


def _read_on(process: subprocess.Popen[str]) -> None:
    """Keep its output from filling the pipe, which would stop it."""
    assert process.stdout is not None
    threading.Thread(target=process.stdout.read, daemon=True).start()
