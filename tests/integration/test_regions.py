"""Regions of a mesh solved in processes of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import meshcone
from meshcone.certificate.file import read_certificate
from meshcone.errors import CrashError, InfeasibleError
from meshcone.processes import at_once, each_of, processes_allowed
from tests import shapes
from tests.integration.waiting import wait_for
from tests.processes import children_of, has_ended


def refined(processes: int, **options: object) -> meshcone.Refined:
    vertices, faces = shapes.sphere(3)
    source = ("rough.obj", shapes.obj(shapes.noisy(vertices), faces))
    reference = ("ball.obj", shapes.obj(vertices, faces))
    return meshcone.refine(
        source, reference, surface={"regions": 5}, processes=processes, **options
    )


@pytest.mark.parametrize(
    "options",
    [{"effort": "fast"}, {"cones": {"max_displacement": {"relative": 0.02}}}],
    ids=["no cone tight", "displacement caps tight"],
)
def test_the_bytes_are_the_same_for_any_number_of_processes(
    options: dict[str, object],
) -> None:
    alone, two, many = (refined(count, **options) for count in (1, 2, 5))

    assert alone.report.solver.regions is not None
    assert alone.report.solver.regions.count == 5
    for other in (two, many):
        assert other.data == alone.data
        assert other.report.certificate == alone.report.certificate
        assert alone.certificate is not None
        assert other.certificate is not None
        certificates = [read_certificate(each.certificate, "made") for each in (alone, other)]
        assert certificates[0].arrays_equal(certificates[1])


def test_the_benchmark_measures_regions_beside_the_whole() -> None:
    script = Path(__file__).parents[2] / "benchmarks" / "regions.py"
    asked = ["--vertices", "500", "--regions", "1", "3", "--processes", "1", "2"]

    done = subprocess.run(
        [sys.executable, str(script), *asked],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )

    assert done.returncode == 0, done.stderr
    rows = [line.split("│")[1:-1] for line in done.stdout.splitlines() if line.startswith("│")]
    assert [[cell.strip() for cell in row[1:3]] for row in rows] == [
        ["1", "1"],
        ["1", "2"],
        ["3", "1"],
        ["3", "2"],
    ]
    assert {row[-1].strip() for row in rows} == {"yes"}
    assert all(0.5 < float(row[-2]) <= 1.02 for row in rows)


def test_results_come_in_the_order_they_were_asked_for() -> None:
    with processes_allowed(3):
        found = list(each_of(7, lambda index: (index * index, os.getpid())))

    assert [square for square, _ in found] == [0, 1, 4, 9, 16, 25, 36]
    assert os.getpid() not in {process for _, process in found}


def test_one_process_is_this_one() -> None:
    assert set(each_of(3, lambda _: os.getpid())) == {os.getpid()}


def test_a_process_starts_no_others() -> None:
    with processes_allowed(2):
        assert list(each_of(2, lambda _: at_once())) == [1, 1]


def test_an_error_in_a_process_is_raised_here() -> None:
    def contradict(index: int) -> None:
        raise InfeasibleError(f"number {index} contradicts itself")

    with processes_allowed(2), pytest.raises(InfeasibleError, match="number 0"):
        list(each_of(2, contradict))


def test_a_process_that_dies_is_an_error_in_words() -> None:
    def die(_: int) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    with processes_allowed(2), pytest.raises(CrashError, match="fewer at once"):
        list(each_of(2, die))


def test_an_error_ends_the_others_at_once() -> None:
    def work(index: int) -> None:
        if index == 0:
            raise InfeasibleError("number 0 contradicts itself")
        time.sleep(600)

    before = set(children_of(os.getpid()))
    with processes_allowed(2), pytest.raises(InfeasibleError):
        list(each_of(2, work))

    wait_for(lambda: all(map(has_ended, set(children_of(os.getpid())) - before)))


def test_nobody_works_on_answers_that_are_not_asked_for() -> None:
    with processes_allowed(2):
        answers = each_of(2, lambda index: time.sleep(600 * index) or os.getpid())
        working = next(answers)
        answers.close()

    wait_for(lambda: has_ended(working))


_PROGRAM = """
import os, time
from meshcone.processes import each_of, processes_allowed
if __name__ == "__main__":
    with processes_allowed(2):
        list(each_of(2, lambda _: (os.write(1, b"begun\\n"), time.sleep(600))))
"""


@contextmanager
def working() -> Iterator[tuple[subprocess.Popen[bytes], list[int]]]:
    """A program whose two processes work, in a group of its own as in a terminal."""
    command = [sys.executable, "-c", _PROGRAM]
    with subprocess.Popen(
        command, start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as program:
        assert program.stdout is not None
        try:
            assert [program.stdout.readline() for _ in range(2)] == [b"begun\n"] * 2
            yield program, children_of(program.pid)
        finally:
            program.kill()


def test_they_end_with_a_parent_that_is_killed() -> None:
    with working() as (program, processes):
        program.kill()

        wait_for(lambda: all(map(has_ended, processes)))


def test_an_interrupt_ends_them_and_their_parent() -> None:
    with working() as (program, processes):
        os.killpg(program.pid, signal.SIGINT)

        wait_for(lambda: all(map(has_ended, [program.pid, *processes])))
