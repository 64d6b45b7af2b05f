"""Checks of sent meshes, and the processes they are done in."""

from __future__ import annotations

import io
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import ExitStack
from pathlib import Path

import pytest
from anyio.from_thread import BlockingPortal, start_blocking_portal

from meshcone.assets import Limits
from meshcone.errors import InputError, LimitError
from meshcone.files import MeshFile
from meshcone.options import Options
from service.api.checking import process
from service.api.checking.checks import CHECKS_AT_ONCE, MeshChecks, MeshFiles
from service.problems import ProblemError
from service.settings import ServiceSettings
from tests.integration.waiting import wait_for
from tests.processes import children_of, has_ended

MEBIBYTE = 2**20
OPTIONS = Options()
Keep = Callable[..., MeshFiles]


class Pipe(io.BytesIO):
    """A file that is read when the test has written it, and not before."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        os.mkfifo(path)
        self._path = path
        self._descriptor = os.open(path, os.O_RDWR)

    def fileno(self) -> int:
        return self._descriptor

    def give(self, data: bytes) -> None:
        os.write(self._descriptor, data)
        os.close(self._descriptor)

    def reader(self, checks: MeshChecks, *, but: int = 0) -> int:
        """The process of a check that has been handed this file."""
        found: list[int] = []

        def look() -> bool:
            found[:] = [pid for pid in children_of(checks.pid) if pid != but and self.is_at(pid)]
            return bool(found)

        wait_for(look)
        return found[0]

    def is_at(self, pid: int) -> bool:
        return str(self._path) in open_files(pid)


def open_files(pid: int) -> list[str]:
    try:
        return [str(link.readlink()) for link in Path(f"/proc/{pid}/fd").iterdir()]
    except FileNotFoundError:
        return []


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


def begun(
    portal: BlockingPortal, checks: MeshChecks, source: MeshFiles, reference: MeshFiles
) -> Future[bool]:
    return portal.start_task_soon(checks.check, source, reference, OPTIONS)


def checked(
    portal: BlockingPortal, checks: MeshChecks, source: MeshFiles, reference: MeshFiles
) -> bool:
    return portal.call(checks.check, source, reference, OPTIONS)


def test_sound_meshes_pass(portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles) -> None:
    assert checked(portal, checks, mesh, mesh)


def test_a_fault_is_told_with_file_and_place(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, kept: Keep
) -> None:
    broken = kept(b"v 0 0 0\nv 1 x 0\n", "broken.obj")

    with pytest.raises(InputError, match="found 'x'") as caught:
        checked(portal, checks, mesh, broken)

    assert (caught.value.file, caught.value.place) == ("broken.obj", "line 2")


def test_a_source_that_cannot_be_written_back_is_refused(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, kept: Keep
) -> None:
    header = (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        b"property float z\nproperty list uchar int of\nelement face 1\n"
        b"property list uchar int vertex_indices\nend_header\n"
    )
    only_readable = kept(header + b"0 0 0 0\n1 0 0 0\n0 1 0 0\n3 0 1 2\n", "mesh.ply")

    assert checked(portal, checks, mesh, only_readable)
    with pytest.raises(InputError) as caught:
        checked(portal, checks, only_readable, mesh)

    assert caught.value.file == "mesh.ply"


def test_a_file_is_handed_over_whole_whatever_its_size(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, kept: Keep
) -> None:
    large = kept(b"# " + b"x" * (8 * MEBIBYTE) + b"\nv 0 0 0\n", "large.obj")

    with pytest.raises(InputError, match="it has no faces"):
        checked(portal, checks, mesh, large)


def test_more_files_come_along_than_one_message_can_carry(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, kept: Keep
) -> None:
    resources = {f"{number}.bin": mesh.file for number in range(300)}
    gltf = MeshFiles("a.gltf", kept(b'{"asset": {"version": "2.0"}}').file, resources)

    with pytest.raises(InputError) as caught:
        checked(portal, checks, mesh, gltf)

    assert caught.value.file == "a.gltf"


def test_memory_is_bounded_and_what_takes_more_is_refused(
    portal: BlockingPortal, kept: Keep
) -> None:
    settings = ServiceSettings(precheck_memory_bytes=64 * MEBIBYTE)
    hungry = kept(b"v 0 0 0\n" * Limits().vertices + b"f 1 2 3\n" * Limits().faces)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    with (
        MeshChecks(settings) as checks,
        pytest.raises(LimitError, match=r"67,108,864 bytes .*MESHCONE_PRECHECK_MEMORY_BYTES"),
    ):
        checked(portal, checks, hungry, hungry)

    grown = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    assert grown < 16 * MEBIBYTE  # of this process, which stands for the API


def test_processor_time_is_bounded_and_what_takes_more_is_refused(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, pipe: Pipe
) -> None:
    running = begun(portal, checks, MeshFiles("slow.obj", pipe), mesh)

    os.kill(pipe.reader(checks), signal.SIGXCPU)  # what the kernel sends when the time is over

    with pytest.raises(
        LimitError, match=r"30 seconds of processor time .*MESHCONE_PRECHECK_SECONDS"
    ):
        running.result(60)


def test_the_kernel_knows_the_limits_of_a_check(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, pipe: Pipe
) -> None:
    running = begun(portal, checks, MeshFiles("p.obj", pipe), mesh)
    child = pipe.reader(checks)

    processor = resource.prlimit(child, resource.RLIMIT_CPU)
    memory = resource.prlimit(child, resource.RLIMIT_DATA)
    written = resource.prlimit(child, resource.RLIMIT_FSIZE)
    pipe.give(b"x")

    assert processor[0] == ServiceSettings().precheck_seconds
    assert 0 < memory[0] - ServiceSettings().precheck_memory_bytes < 512 * MEBIBYTE
    assert written == (0, process.SCRATCH_BYTES)  # the second is for programs it starts
    with pytest.raises(InputError):
        running.result(60)


def test_a_check_has_its_files_and_nothing_else(
    portal: BlockingPortal, mesh: MeshFiles, pipe: Pipe, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MESHCONE_REDIS_URL", "redis://:password@broker:6379")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
    monkeypatch.setenv("MESHCONE_LIMIT_VERTICES", "1234")
    with MeshChecks(ServiceSettings()) as checks:
        running = begun(portal, checks, MeshFiles("p.obj", pipe), mesh)
        child = pipe.reader(checks)

        environment = Path(f"/proc/{child}/environ").read_bytes()
        files = [name for name in open_files(child) if name not in open_files(checks.pid)]
        pipe.give(b"x")
        with pytest.raises(InputError):
            running.result(60)

    assert b"MESHCONE_LIMIT_VERTICES=1234" in environment
    assert b"password" not in environment
    assert b"secret" not in environment
    assert len([name for name in files if name.startswith("socket:")]) == 1  # to answer on
    assert len(files) <= 4  # beside it the two meshes and the request


def test_a_check_that_was_killed_is_done_again(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, pipe: Pipe, ball: MeshFile
) -> None:
    running = begun(portal, checks, mesh, MeshFiles("ball.obj", pipe))
    first = pipe.reader(checks)

    os.kill(first, signal.SIGKILL)
    pipe.reader(checks, but=first)
    pipe.give(ball.data[:1000])

    with pytest.raises(InputError, match=r"ball\.obj"):  # it is read, and cut off
        running.result(60)


def test_meshes_that_kill_their_check_twice_are_left_to_a_worker(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, pipe: Pipe
) -> None:
    running = begun(portal, checks, mesh, MeshFiles("p.obj", pipe))
    first = pipe.reader(checks)
    os.kill(first, signal.SIGSEGV)
    os.kill(pipe.reader(checks, but=first), signal.SIGSEGV)

    assert running.result(60) is False
    assert checked(portal, checks, mesh, mesh)


def test_the_parent_of_all_checks_is_started_again(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, pipe: Pipe
) -> None:
    running = begun(portal, checks, mesh, MeshFiles("p.obj", pipe))
    parent, child = checks.pid, pipe.reader(checks)

    os.kill(parent, signal.SIGKILL)
    wait_for(lambda: checks.pid != parent)
    pipe.reader(checks)
    pipe.give(b"x")

    with pytest.raises(InputError):
        running.result(60)
    wait_for(lambda: has_ended(child))


def test_who_waits_too_long_for_others_checks_is_told_when_to_come_again(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, tmp_path: Path
) -> None:
    pipes = [Pipe(tmp_path / str(number)) for number in range(CHECKS_AT_ONCE)]
    running = [begun(portal, checks, MeshFiles("p.obj", pipe), mesh) for pipe in pipes]
    for pipe in pipes:
        pipe.reader(checks)

    with pytest.raises(ProblemError) as caught:
        checked(portal, checks, mesh, mesh)
    for pipe in pipes:
        pipe.give(b"x")

    assert caught.value.problem.status == 503
    assert caught.value.headers is not None
    assert int(caught.value.headers["Retry-After"]) > 0
    for each in running:
        assert isinstance(each.exception(60), InputError)
    assert checked(portal, checks, mesh, mesh)


def test_a_check_that_does_not_end_is_ended_and_others_go_on(
    portal: BlockingPortal, mesh: MeshFiles, pipe: Pipe
) -> None:
    with MeshChecks(ServiceSettings(), check_seconds=1) as checks:
        parent = checks.pid
        with pytest.raises(ProblemError) as caught:  # nobody writes what it wants to read
            checked(portal, checks, MeshFiles("p.obj", pipe), mesh)

        assert caught.value.problem.status == 503
        # Where it did not fork in time, on a busy machine, it counts as one that hangs.
        wait_for(lambda: not any(pipe.is_at(pid) for pid in children_of(parent)))
    with MeshChecks(ServiceSettings()) as checks:
        assert checked(portal, checks, mesh, mesh)


def test_a_parent_of_all_checks_that_hangs_is_replaced(
    portal: BlockingPortal, mesh: MeshFiles
) -> None:
    with MeshChecks(ServiceSettings(), check_seconds=1) as checks:
        hanging = checks.pid
        assert checked(portal, checks, mesh, mesh)
        os.kill(hanging, signal.SIGSTOP)

        def check_twice() -> None:  # the child that waits already takes the first
            for _ in range(2):
                checked(portal, checks, mesh, mesh)

        with pytest.raises(ProblemError) as caught:
            check_twice()

        assert caught.value.problem.status == 503
        assert has_ended(hanging)


def test_of_twenty_at_once_two_are_read_and_all_are_answered(
    portal: BlockingPortal, mesh: MeshFiles, tmp_path: Path
) -> None:
    pipes = [Pipe(tmp_path / str(number)) for number in range(CHECKS_AT_ONCE)]
    with MeshChecks(ServiceSettings()) as checks:
        first = [begun(portal, checks, MeshFiles("p.obj", pipe), mesh) for pipe in pipes]
        readers = {pipe.reader(checks) for pipe in pipes}
        others = [begun(portal, checks, mesh, mesh) for _ in range(20 - CHECKS_AT_ONCE)]

        wait_for(lambda: len(children_of(checks.pid)) == CHECKS_AT_ONCE + 1)  # one for the next
        assert readers < set(children_of(checks.pid))
        for pipe in pipes:
            pipe.give(b"x")

        assert all(isinstance(each.exception(60), InputError) for each in first)
        assert all(each.result(60) for each in others)


def test_a_child_that_is_killed_while_it_waits_is_replaced(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles
) -> None:
    assert checked(portal, checks, mesh, mesh)
    wait_for(lambda: bool(children_of(checks.pid)))
    for waiting in children_of(checks.pid):
        os.kill(waiting, signal.SIGKILL)

    assert checked(portal, checks, mesh, mesh)


_PROGRAM = """
import sys, time
from service.api.checking.checks import MeshChecks
from service.settings import ServiceSettings
with MeshChecks(ServiceSettings()) as checks:
    print(checks.pid, flush=True)
    time.sleep(600)
"""


def test_the_processes_end_with_the_api_however_that_ends() -> None:
    with subprocess.Popen([sys.executable, "-c", _PROGRAM], stdout=subprocess.PIPE) as api:
        assert api.stdout is not None
        parent = int(api.stdout.readline())
        wait_for(lambda: bool(children_of(parent)))
        waiting = children_of(parent)
        api.kill()

    wait_for(lambda: all(map(has_ended, [parent, *waiting])))
