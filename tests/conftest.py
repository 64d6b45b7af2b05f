"""What tests of several kinds share: meshes made here, and one running service."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests import shapes
from tests.completeness import (
    pytest_runtest_logreport,
    pytest_runtest_makereport,
    pytest_sessionfinish,
)
from tests.holding import Hold
from worker.settings import WorkerSettings

__all__ = ["pytest_runtest_logreport", "pytest_runtest_makereport", "pytest_sessionfinish"]

ROOT = Path(__file__).parent

# Files are shared out among processes whole. One of these that began last would be waited for.
LONGEST_FILES = (
    "acceptance/test_demo.py",
    "acceptance/test_how_tos.py",
    "acceptance/test_console_examples.py",
    "acceptance/test_gate.py",
    "integration/test_fault_storm.py",
    "integration/test_supervision.py",
    "acceptance/test_command_line.py",
    "integration/test_faults.py",
    "acceptance/dashboard/test_job_viewer.py",
    "acceptance/dashboard/test_job_page.py",
    "integration/test_attempts.py",
    "integration/test_stack.py",
    "integration/test_rq_tools.py",
    "integration/test_generated_clients.py",
    "integration/test_full_disk.py",
    "integration/test_object_store.py",
)

# Chosen by --hypothesis-profile; an example may take as long as a busy machine needs.
settings.register_profile("suite", deadline=None)
# Where CI is set, Hypothesis would try the same examples at every run.
settings.register_profile(
    "fuzz", deadline=None, max_examples=5_000, derandomize=False, print_blob=True
)
settings.load_profile("suite")

# A shell that runs the suite in the background has it ignore interrupts, and all it starts too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Have the longest files begin first."""
    ranks = {ROOT / name: rank for rank, name in enumerate(LONGEST_FILES)}
    items.sort(key=lambda item: ranks.get(item.path, len(ranks)))


@pytest.fixture(scope="session")
def ball() -> MeshFile:
    """The reference: a smooth ball."""
    return MeshFile("ball.obj", shapes.obj(*shapes.sphere()))


@pytest.fixture(scope="session")
def rough_ball() -> MeshFile:
    """The source: the ball with noise."""
    vertices, faces = shapes.sphere()
    return MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces))


@pytest.fixture(scope="session")
def data_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the session's service keeps its data."""
    return tmp_path_factory.mktemp("service")


@pytest.fixture(scope="session")
def service_hold(tmp_path_factory: pytest.TempPathFactory) -> Hold:
    return Hold(tmp_path_factory.mktemp("held"))


@pytest.fixture(scope="session")
def stack(data_dir: Path, service_hold: Hold) -> Iterator[Stack]:
    """Broker, API and a worker, in processes of their own."""
    settings = WorkerSettings(data_dir=data_dir)
    with service_hold.stack(settings, log=data_dir / "service.log") as running:
        yield running


@pytest.fixture
def hold(service_hold: Hold) -> Iterator[Hold]:
    """Keeps jobs of the session's service at work, until the test's end at most."""
    yield service_hold
    service_hold.release()


@pytest.fixture
def client(stack: Stack) -> Iterator[Client]:
    """A client of the session's service."""
    with Client(stack.url) as connected:
        yield connected
