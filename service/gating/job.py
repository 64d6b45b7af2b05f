"""What is to be done with pairs, wherever it is done."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from typing import Protocol

from meshcone.errors import MeshConeError
from meshcone.gates.records import GateVerdict
from meshcone.gates.results import NO_GATE, AssetError, AssetResult, GateRun, Judgement
from meshcone.notices import Code, warning
from meshcone.options import Options
from service.gating.pairs import Pair, shown

# Gates on what an audit says as well as a measurement does.
_OF_AUDIT = ("asset.", "changes.", "warnings.normals")


@dataclass(frozen=True)
class GateJob:
    """A pair and the options of the work on it, with its gates and the mode among them.

    Attributes:
        viewed: whether the result is to carry what a page shows of it.
        label: what the run is called, if anything.
        reported: whether the result is to carry the report, also where no gate applies.
    """

    pair: Pair
    options: Options
    viewed: bool = False
    label: str | None = None
    reported: bool = False

    @property
    def asks(self) -> bool:
        """Whether there is anything to be done: a gate applies, or the report is wanted."""
        return bool(self.options.gates or self.options.keep or self.reported)

    def result(self, seconds: float, found: Judgement | MeshConeError | AssetError) -> AssetResult:
        """What came of the job, and the time it took."""
        if isinstance(found, MeshConeError):
            found = AssetError.of(found)
        fields = found.fields() if isinstance(found, Judgement) else {"error": found}
        return AssetResult(
            name=self.pair.name,
            source=shown(self.pair.source),
            reference=None if self.pair.reference is None else shown(self.pair.reference),
            lod=self.pair.level,
            seconds=seconds,
            **fields,
        )

    def at_least_cost(self) -> GateJob:
        """The same job as an audit, where all its gates are about what an audit says.

        Measuring takes several times as long and leaves that as it is, unless it brings the source
        to the reference first, which says where on a mesh its materials are.
        """
        of_audit = all(key.startswith(_OF_AUDIT) for key in self.options.gates)
        asks = self.options.gates or self.options.keep
        unmoved = self.options.align == "none"
        if self.options.mode != "measure" or not (asks and of_audit and unmoved):
            return self
        return replace(self, options=self.options.model_copy(update={"mode": "audit"}))


UNGATED = Judgement(GateVerdict.of(()), (warning(Code.GATES_NONE, "pair", NO_GATE),))
"""What is said of an asset that no gate applies to."""


class Gatekeeper(Protocol):
    """Whoever does such jobs, several at a time, each in a thread of the caller's."""

    def judge(self, job: GateJob) -> AssetResult:
        """Do a job; its errors are part of the answer."""

    def stop(self) -> None:
        """Give up what is being done."""


def judged(job: GateJob, work: Callable[[GateJob], Judgement]) -> AssetResult:
    """Do a job and make a result of what it returns or raises on purpose."""
    started = time.monotonic()
    try:
        judgement = work(job) if job.asks else UNGATED
    except MeshConeError as error:
        return job.result(time.monotonic() - started, error)
    return job.result(time.monotonic() - started, judgement)


def run_jobs(
    jobs: Sequence[GateJob],
    keeper: Gatekeeper,
    at_once: int,
    on_result: Callable[[AssetResult], None],
) -> GateRun:
    """Do all jobs, ``at_once`` at a time, and keep their order.

    ``on_result`` sees each result as it comes.
    """
    with ThreadPoolExecutor(max_workers=at_once) as threads:
        try:
            futures = [threads.submit(keeper.judge, job) for job in jobs]
            for future in as_completed(futures):
                on_result(future.result())
        except BaseException:  # also Ctrl-C: nothing may go on behind the caller's back
            threads.shutdown(wait=False, cancel_futures=True)
            keeper.stop()
            raise
        return GateRun.of([future.result() for future in futures], jobs[0].label)
