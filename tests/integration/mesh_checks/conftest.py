"""Checks, and files for them that are open until a test ends."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from anyio.from_thread import BlockingPortal, start_blocking_portal

from meshcone.files import MeshFile
from service.api.checking.checks import MeshChecks, MeshFiles
from service.settings import ServiceSettings
from tests.integration.mesh_checks.checking import (
    Keep,
    Pipe,
)


@pytest.fixture
def kept() -> Iterator[Keep]:
    """Makes files that are open until the test ends."""
    with ExitStack() as opened:

        def keep(data: bytes, name: str = "mesh.obj") -> MeshFiles:
            file = opened.enter_context(os.fdopen(os.memfd_create(name), "w+b"))
            file.write(data)
            return MeshFiles(name, file)

        yield keep


@pytest.fixture
def portal() -> Iterator[BlockingPortal]:
    with start_blocking_portal() as started:
        yield started


@pytest.fixture
def checks() -> Iterator[MeshChecks]:
    with MeshChecks(ServiceSettings(), turn_seconds=0.1) as started:
        yield started


@pytest.fixture
def pipe(tmp_path: Path) -> Pipe:
    return Pipe(tmp_path / "pipe")


@pytest.fixture
def mesh(ball: MeshFile, kept: Keep) -> MeshFiles:
    return kept(ball.data)
