"""The processes that sent meshes are checked in: killed, hanging, replaced, ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from anyio.from_thread import BlockingPortal

from meshcone.errors import InputError
from meshcone.files import MeshFile
from service.api.checking.checks import CHECKS_AT_ONCE, MeshChecks, MeshFiles
from service.problems import ProblemError
from service.settings import ServiceSettings
from tests.integration.mesh_checks.checking import (
    Keep,
    Pipe,
    begun,
    checked,
)
from tests.integration.waiting import wait_for
from tests.processes import children_of, has_ended


def test_a_check_that_was_killed_is_done_again(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, pipe: Pipe, ball: MeshFile
) -> None:
    running = begun(portal, checks, mesh, MeshFiles("ball.obj", pipe))
    first = pipe.reader(checks)

    os.kill(first, signal.SIGKILL)
    pipe.reader(checks, but=first)
    pipe.give(ball.data[:1000])

    with pytest.raises(InputError, match=r"ball\.obj"):  # it is read, and cut off
        running.result(240)


def test_meshes_that_kill_their_check_twice_are_left_to_a_worker(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, pipe: Pipe
) -> None:
    running = begun(portal, checks, mesh, MeshFiles("p.obj", pipe))
    first = pipe.reader(checks)
    os.kill(first, signal.SIGSEGV)
    os.kill(pipe.reader(checks, but=first), signal.SIGSEGV)

    assert running.result(240) is False
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
        running.result(240)
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
        assert isinstance(each.exception(240), InputError)
    assert checked(portal, checks, mesh, mesh)


def test_a_check_that_does_not_end_is_ended_and_its_files_left_to_a_worker(
    portal: BlockingPortal, mesh: MeshFiles, pipe: Pipe
) -> None:
    with MeshChecks(ServiceSettings(), check_seconds=1) as checks:
        parent = checks.pid
        # Nobody writes what it wants to read.
        assert checked(portal, checks, MeshFiles("p.obj", pipe), mesh) is False
        # Where it did not fork in time, on a busy machine, it counts as one that hangs.
        wait_for(lambda: not any(pipe.is_at(pid) for pid in children_of(parent)))
    with MeshChecks(ServiceSettings()) as checks:
        assert checked(portal, checks, mesh, mesh)


def test_a_parent_of_all_checks_that_hangs_is_replaced(
    portal: BlockingPortal, mesh: MeshFiles, monkeypatch: pytest.MonkeyPatch
) -> None:
    with MeshChecks(ServiceSettings()) as checks:
        hanging = checks.pid
        assert checked(portal, checks, mesh, mesh)  # its readers are imported by then
        monkeypatch.setattr(checks, "_check_seconds", 1)
        os.kill(hanging, signal.SIGSTOP)

        # The child that waits already takes the first.
        assert checked(portal, checks, mesh, mesh)
        assert checked(portal, checks, mesh, mesh) is False
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

        assert all(isinstance(each.exception(240), InputError) for each in first)
        assert all(each.result(240) for each in others)


def test_a_child_that_is_killed_while_it_waits_is_replaced(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles
) -> None:
    assert checked(portal, checks, mesh, mesh)
    wait_for(lambda: bool(children_of(checks.pid)))
    for waiting in children_of(checks.pid):
        os.kill(waiting, signal.SIGKILL)

    assert checked(portal, checks, mesh, mesh)


_CONVERTER = """
import os, pathlib, resource, time
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
pathlib.Path("scene.usd").write_bytes(b"left")
pathlib.Path({told!r}).write_text(str(os.getpid()))
time.sleep(600)
"""

_REPLACED = """
import pathlib
import meshcone.assets.converted.process as process
process._CHILD = pathlib.Path({child!r})
"""


@pytest.fixture
def converter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], int]:
    """Has design files converted by a program that does not end; finds its process."""
    told, child = tmp_path / "told", tmp_path / "child.py"
    child.write_text(_CONVERTER.format(told=str(told)))
    (tmp_path / "sitecustomize.py").write_text(_REPLACED.format(child=str(child)))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    monkeypatch.setenv("TMPDIR", str(tmp_path))

    def running() -> int:
        wait_for(lambda: told.exists() and bool(told.read_text()))
        return int(told.read_text())

    return running


def parent_of(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


@pytest.mark.parametrize("number", [signal.SIGALRM, signal.SIGKILL])
def test_a_check_whose_time_is_over_or_that_is_killed_leaves_no_process_and_no_file(
    portal: BlockingPortal,
    mesh: MeshFiles,
    kept: Keep,
    converter: Callable[[], int],
    tmp_path: Path,
    number: signal.Signals,
) -> None:
    with MeshChecks(ServiceSettings()) as checks:
        running = begun(portal, checks, mesh, kept(b"#usda 1.0\n", "a.usda"))
        first = converter()
        [place] = tmp_path.glob("meshcone-job-*")
        assert list(place.rglob("scene.usd"))

        os.kill(parent_of(first), number)

        wait_for(lambda: has_ended(first) and not place.exists())
        if number == signal.SIGALRM:
            assert running.result(60) is False
    running.cancel()


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
