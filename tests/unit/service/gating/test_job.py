"""Doing many jobs at a time."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from meshcone.gates.results import AssetResult
from meshcone.options import Options, parse_options
from service.gating.job import GateJob, run_jobs
from service.gating.pairs import single_pair

JOB = GateJob(single_pair(Path("a.obj"), Path("b.obj")), Options())


class EndlessKeeper:
    """Works on a job until it is told to stop."""

    def __init__(self) -> None:
        self.begun = threading.Event()
        self.stopped = threading.Event()

    def judge(self, job: GateJob) -> AssetResult:
        self.begun.set()
        assert self.stopped.wait(60)
        return AssetResult(name=job.pair.name, source="", reference="", seconds=0.0)

    def stop(self) -> None:
        self.stopped.set()


class InterruptedJobs(list[GateJob]):
    """Jobs whose reader is interrupted once the first of them is being done."""

    def __init__(self, keeper: EndlessKeeper) -> None:
        super().__init__([JOB, JOB])
        self._keeper = keeper

    def __iter__(self) -> Iterator[GateJob]:
        yield JOB
        assert self._keeper.begun.wait(60)
        raise KeyboardInterrupt


def test_an_interrupt_while_jobs_are_still_handed_out_ends_those_that_run() -> None:
    keeper = EndlessKeeper()

    with pytest.raises(KeyboardInterrupt):
        run_jobs(InterruptedJobs(keeper), keeper, 1, lambda _: None)

    assert keeper.stopped.is_set()


@pytest.mark.parametrize(("align", "mode"), [("none", "audit"), ("rigid", "measure")])
def test_what_is_kept_is_audited_unless_the_source_is_moved_first(align: str, mode: str) -> None:
    options = parse_options({"mode": "measure", "keep": ["all"], "align": align})

    assert GateJob(JOB.pair, options).at_least_cost().options.mode == mode
