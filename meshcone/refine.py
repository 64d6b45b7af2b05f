"""Refine a mesh file against a reference file: the engine's main entry."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version
from pathlib import PurePath

import numpy as np

from meshcone.files import MeshFile
from meshcone.options import Options
from meshcone.outcome import decide_outcome
from meshcone.pair import Pair, read_pair
from meshcone.program.diagnostics import SolverReport
from meshcone.program.rounds import RefinedPositions, refine_centroid, refine_surface
from meshcone.progress import Progress, ProgressCallback, Stage
from meshcone.report import Displacement, Report, Timings
from meshcone.scoring import Scorer
from meshcone.stopwatch import Stopwatch
from meshcone.surface.arrays import Floats

# Share of the whole work that is done when each stage begins; measured at 4k vertices.
_STAGE_STARTS: dict[Stage, float] = {"read": 0.0, "solve": 0.1, "write": 0.65, "quality": 0.7}


@dataclass(frozen=True)
class Refinement:
    """The answer to a refinement.

    Attributes:
        name: file name of the refined file.
        data: the refined file, in the source's format.
        media_type: its media type.
        report: what was done and how good the result is.
    """

    name: str
    data: bytes
    media_type: str
    report: Report


def refine(
    source: MeshFile,
    reference: MeshFile,
    options: Options,
    progress: ProgressCallback | None = None,
) -> Refinement:
    """Refine ``source`` against ``reference``.

    Args:
        source: the mesh to refine; OBJ, GLB or glTF.
        reference: the mesh it should have been; not changed.
        options: resolved options.
        progress: called between stages and rounds.

    Raises:
        InputError, LimitError: a file cannot be used; the message says which and why.
        InfeasibleError: the requested constraints contradict each other.
        SolveTimeoutError: ``options.solver.time_limit`` passed.
    """
    tracker = _Tracker(progress)
    watch = Stopwatch()
    tracker.enter("read")
    with watch.stage("read"):
        pair = read_pair(source, reference)
    tracker.enter("solve")
    with watch.stage("solve"):
        solved = _solve(pair, options, tracker)
    tracker.enter("write")
    with watch.stage("write"):
        positions = pair.frame.out_of(solved.positions)
        data = pair.source_asset.patched(positions, normals=options.normals)
        written = pair.written_positions(data)
    tracker.enter("quality")
    with watch.stage("quality"):
        report = _report(pair, options, solved, written, watch)
    return Refinement(
        name=_refined_name(pair.source_asset.name),
        data=data,
        media_type=pair.source_asset.media_type,
        report=report.model_copy(update={"timings": _timings(watch)}),
    )


def _solve(pair: Pair, options: Options, tracker: _Tracker) -> RefinedPositions:
    if options.formulation == "centroid":
        return refine_centroid(pair.source, pair.reference, options)
    return refine_surface(pair.source, pair.reference, options, tracker.round_done)


def _report(
    pair: Pair, options: Options, solved: RefinedPositions, written: Floats, watch: Stopwatch
) -> Report:
    scorer = Scorer(pair.reference, options)
    before, after = scorer.score(pair.source), scorer.score(pair.source.moved_to(written))
    moves = np.linalg.norm(written - pair.source.vertices, axis=1)
    solver = SolverReport(
        formulation=options.formulation,
        form=options.centroid.form if options.formulation == "centroid" else "reduced",
        solved=all(record.info.solved for record in solved.rounds),
        iterations=sum(record.info.iterations for record in solved.rounds),
        rounds=solved.rounds,
    )
    return Report(
        version=version("meshcone"),
        outcome=decide_outcome(
            before, after, scorer.floor, float(moves.max()), solved.copied_reference
        ),
        inputs=pair.inputs(),
        frame=pair.frame_record(),
        options=options,
        quality=scorer.quality(before, after),
        displacement=Displacement(mean=float(moves.mean()), max=float(moves.max())),
        solver=solver,
        warnings=pair.warnings() + _solver_warnings(solver),
        timings=_timings(watch),
    )


def _solver_warnings(solver: SolverReport) -> list[str]:
    return [
        f"round {record.round}: the solver stopped after {record.info.iterations} iterations "
        "without meeting its tolerance"
        for record in solver.rounds
        if not record.info.solved
    ]


def _timings(watch: Stopwatch) -> Timings:
    stages = ("read", "solve", "quality", "write")
    return Timings(**{name: watch.seconds.get(name, 0.0) for name in stages}, total=watch.total)


def _refined_name(name: str) -> str:
    path = PurePath(name)
    return f"{path.stem}.refined{path.suffix}"


class _Tracker:
    """Turns stages and rounds into progress."""

    def __init__(self, callback: ProgressCallback | None) -> None:
        self._callback = callback
        self._round = 0
        self._rounds = 0

    def enter(self, stage: Stage) -> None:
        self._emit(stage, _STAGE_STARTS[stage])

    def round_done(self, done: int, rounds: int) -> None:
        self._round, self._rounds = done, rounds
        start, end = _STAGE_STARTS["solve"], _STAGE_STARTS["write"]
        self._emit("solve", start + (end - start) * done / rounds)

    def _emit(self, stage: Stage, fraction: float) -> None:
        if self._callback is not None:
            self._callback(Progress(stage, self._round, self._rounds, fraction))
