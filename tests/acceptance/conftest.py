"""What tests of files by URL share: who has the files, and a service that may ask for them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from service.stack import Stack
from tests.integration.file_server import FileServer, file_server
from worker.settings import WorkerSettings


@pytest.fixture
def server() -> Iterator[FileServer]:
    """A server of files on this machine."""
    with file_server() as started:
        yield started


@pytest.fixture(scope="module")
def fetching(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """A service that may fetch from this machine."""
    directory = tmp_path_factory.mktemp("fetching")
    running = Stack(WorkerSettings(data_dir=directory), log=directory / "log")
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("MESHCONE_TRANSFER_PRIVATE_ADDRESSES", "true")
        running.start()  # whatever else starts while it lives is to have no such environment
    try:
        yield running
    finally:
        running.stop()
