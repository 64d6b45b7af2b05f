"""Regions of a mesh solved in processes of their own."""

from __future__ import annotations

import os
import signal

import pytest

import meshcone
from meshcone.certificate.file import read_certificate
from meshcone.errors import CrashError, InfeasibleError
from meshcone.processes import each_of, processes_allowed
from tests import shapes


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


def test_results_come_in_the_order_they_were_asked_for() -> None:
    with processes_allowed(3):
        found = list(each_of(7, lambda index: (index * index, os.getpid())))

    assert [square for square, _ in found] == [0, 1, 4, 9, 16, 25, 36]
    assert os.getpid() not in {process for _, process in found}


def test_one_process_is_this_one() -> None:
    assert set(each_of(3, lambda _: os.getpid())) == {os.getpid()}


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
