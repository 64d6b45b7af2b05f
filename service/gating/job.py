"""What is to be done with pairs, wherever it is done."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from typing import Any, Protocol

from meshcone.errors import MeshConeError
from meshcone.gates.records import GateVerdict
from meshcone.gates.results import AssetError, AssetResult, AssetView, GateRun
from meshcone.notices import Code, WarningRecord, warning
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

    def at_least_cost(self) -> GateJob:
        """The same job as an audit, where all its gates are about what an audit says.

        Measuring takes several times as long and leaves that as it is.
        """
        of_audit = all(key.startswith(_OF_AUDIT) for key in self.options.gates)
        asks = self.options.gates or self.options.keep
        if self.options.mode != "measure" or not (asks and of_audit):
            return self
        return replace(self, options=self.options.model_copy(update={"mode": "audit"}))


@dataclass(frozen=True)
class Judgement:
    """What came of a job that was done."""

    verdict: GateVerdict
    warnings: tuple[WarningRecord, ...]
    view: AssetView | None = None
    statement: str | None = None

    @staticmethod
    def of(report: dict[str, Any], view: AssetView | None = None) -> Judgement:
        """Take it from a report as JSON."""
        gates = report["gates"]
        verdict = GateVerdict.of(()) if gates is None else GateVerdict.model_validate(gates)
        warnings = tuple(map(WarningRecord.model_validate, report["warnings"]))
        return Judgement(verdict, warnings, view, report.get("statement"))


_UNGATED = Judgement(
    GateVerdict.of(()), (warning(Code.GATES_NONE, "pair", "No gate applies to this asset."),)
)


class Gatekeeper(Protocol):
    """Whoever does such jobs, several at a time, each in a thread of the caller's."""

    def judge(self, job: GateJob) -> AssetResult:
        """Do a job; its errors are part of the answer."""

    def stop(self) -> None:
        """Give up what is being done."""


def judged(job: GateJob, work: Callable[[GateJob], Judgement]) -> AssetResult:
    """Do a job and make a result of what it returns or raises on purpose."""
    started = time.monotonic()
    judgement: Judgement | None = None
    error: AssetError | None = None
    try:
        asked = job.options.gates or job.options.keep or job.reported
        judgement = work(job) if asked else _UNGATED
    except MeshConeError as found:
        error = AssetError.of(found)
    return AssetResult(
        name=job.pair.name,
        source=shown(job.pair.source),
        reference=None if job.pair.reference is None else shown(job.pair.reference),
        lod=job.pair.level,
        seconds=time.monotonic() - started,
        verdict=judgement.verdict if judgement else None,
        error=error,
        warnings=judgement.warnings if judgement else (),
        view=judgement.view if judgement else None,
        statement=judgement.statement if judgement else None,
    )


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
