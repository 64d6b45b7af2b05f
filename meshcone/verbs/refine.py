"""Refine a mesh file against a reference file: the engine's main entry."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib.metadata import version

from meshcone.certificate.certify import certify
from meshcone.certificate.file import CertificateDocument, CertificateFile, Closeness
from meshcone.deadline import time_allowed
from meshcone.detailing import Solution, require_divisible, solve_in_detail
from meshcone.files import MeshFile
from meshcone.formulation import formulate
from meshcone.gates.fitting import require_known
from meshcone.gates.judge import judged
from meshcone.notices import Code, Told
from meshcone.options import Options
from meshcone.pair import Pair, read_pair
from meshcone.program.answer import RefinedPositions
from meshcone.program.tension import vertex_tension
from meshcone.progress import Progress, ProgressCallback, Stage
from meshcone.quality.deviation.proving import ProvenDeviation
from meshcone.quality.records import Metrics
from meshcone.quality.validity import inspect
from meshcone.report.asset_checks import NOT_AUDITED
from meshcone.report.audits import Audited, audited
from meshcone.report.data_checks import appearance_warnings
from meshcone.report.misfit import misfit
from meshcone.report.outcome import decide_outcome
from meshcone.report.report import Displacement, Report, Timings
from meshcone.report.scoring import Scorer
from meshcone.report.solver import solver_report, solver_warnings
from meshcone.report.statement import statement
from meshcone.stopwatch import Stopwatch
from meshcone.surface.arrays import Floats
from meshcone.views.scene import Scene
from meshcone.written import WrittenFile, write_refined

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
        certificate: the certificate file; of a source that was kept, it is about closeness alone.
            None where nothing is to be proven of that either.
        scene: what there is to see of it.
    """

    name: str
    data: bytes = field(repr=False)
    media_type: str
    report: Report = field(repr=False)
    certificate: bytes | None = field(repr=False)
    scene: Scene = field(repr=False)


def refine(
    source: MeshFile,
    reference: MeshFile,
    options: Options,
    progress: ProgressCallback | None = None,
    solve_seconds: float | None = None,
) -> Refinement:
    """Refine ``source`` against ``reference``.

    Args:
        source: the mesh to refine, in any format that is read (OBJ, GLB, glTF, PLY, STL, OFF).
        reference: the mesh it should have been; not changed.
        options: resolved options.
        progress: called between stages and rounds.
        solve_seconds: what alignment and solve may take at most, whatever the options allow.
            It is the machine's business: report and certificate state the options as they are.

    Raises:
        InputError, LimitError: a file or a gate cannot be used; the message says which and why.
        InfeasibleError: the requested constraints contradict each other.
        SolveTimeoutError: ``options.solver.time_limit`` or ``solve_seconds`` passed.
        InternalError: what was written is not what is read back.
    """
    require_known(options.gates, "refine")
    tracker = _Tracker(progress)
    watch = Stopwatch()
    tracker.enter("read")
    with watch.stage("read"):
        sent = read_pair(source, reference, options).under(options)
        sent.require_units(options)
        require_divisible(sent, options)
    limited = _limited(options, solve_seconds)
    with time_allowed(limited.solver.time_limit):
        with watch.stage("align"):
            if options.align != "none":
                sent = sent.aligned(options.align, options.seed)
        tracker.enter("solve")
        with watch.stage("solve"):
            apart = misfit(
                sent.source, sent.reference, options.seed, aligned=options.align != "none"
            )
            if apart is None:
                solution = solve_in_detail(sent, limited, tracker.level_done, tracker.round_done)
            else:
                returned = RefinedPositions(sent.source.vertices, [], None, misaligned=apart)
                solution = Solution(sent, formulate(sent, limited), returned)
            pair, solved = solution.pair, solution.answer
    tracker.enter("write")
    with watch.stage("write"):
        written = write_refined(pair, solved)
    tracker.enter("quality")
    with watch.stage("quality"):
        parts = pair.measured_parts(options)
        scorer = Scorer(pair.source, pair.reference, options, pair.collapsed, parts)
        vertices = written.vertices
        after = scorer.refined(pair.source.moved_to(vertices.in_frame))
        # What is proven is of the file: of every copy that it has of a vertex.
        uncertain = pair.tolerance + vertices.uncertain
        proven = scorer.deviation(pair.frame, pair.gates(options), uncertain)
        report = _report(sent, solution, scorer, options, written, after, proven)
    with watch.stage("audit"):
        if options.audit:
            report = _with_audit(report, sent, written)
    return Refinement(
        name=written.record.name,
        data=written.data,
        media_type=pair.source_asset.media_type,
        # Only now is the last stage over.
        report=judged(report.model_copy(update={"timings": _timings(watch, report)})),
        certificate=_certificate(sent, solution, options, written, proven),
        scene=scorer.scene(pair.frame, _tension(solution)),
    )


def _limited(options: Options, seconds: float | None) -> Options:
    asked = options.solver.time_limit
    if seconds is None or 0 < asked <= seconds:
        return options
    solver = options.solver.model_copy(update={"time_limit": seconds})
    return options.model_copy(update={"solver": solver})


def _report(
    sent: Pair,
    solution: Solution,
    scorer: Scorer,
    options: Options,
    written: WrittenFile,
    after: Metrics,
    proven: ProvenDeviation | None,
) -> Report:
    pair, problem, solved = solution.pair, solution.problem, solution.answer
    appearance = scorer.appearance(*pair.paints)
    validity = scorer.input.validity, scorer.floor.validity
    moves = written.vertices.away_from(pair.source.vertices)
    certificate = None
    if solved.final is not None:
        certificate = certify(problem, solved.final, written.vertices, options.solver.tolerance)
    solver = solver_report(options, solved)
    told = (
        pair.warnings(*validity, written.asset)
        + appearance_warnings(appearance, asked=options.quality.appearance)
        + Told(solver_warnings(solver, solved, problem.unmet()))
    )
    if not options.audit:
        told += NOT_AUDITED
    came = validity[0]
    if solution.subdivision is not None:
        changed = sent.source_asset.division_notices(solution.subdivision)
        told += Told([each.about("source", sent.source_asset.name) for each in changed])
    if pair is not sent:  # what was scored has other faces than what was sent
        pairs = options.quality.intersection_pairs
        came = inspect(sent.source, pairs, collapsed=sent.collapsed[0])
    return Report(
        version=version("meshcone"),
        statement=proven and statement(proven.record, pair.unit(options)),
        outcome=decide_outcome(
            before=scorer.input,
            after=after,
            floor=scorer.floor,
            samples=options.quality.samples,
            largest_move=float(moves.max()),
            solved=solved,
            is_opposed=told.has(Code.NORMALS_OPPOSED),
        ),
        inputs=sent.inputs(came, validity[1]),
        frame=pair.frame_record(),
        alignment=pair.alignment_record(),
        options=options,
        quality=scorer.quality(after, pair.frame),
        appearance=appearance,
        deviation=proven and proven.record,
        output=written.record,
        displacement=Displacement(mean=float(moves.mean()), max=float(moves.max())),
        detail=solution.detail,
        solver=solver,
        certificate=certificate,
        **told.section(),
        timings=Timings(read=0, quality=0, total=0, metrics=scorer.seconds),
    )


def _with_audit(report: Report, pair: Pair, written: WrittenFile) -> Report:
    refined = report.quality.refined
    assert refined is not None  # noqa: S101 - the report is of a refinement
    file = MeshFile(written.record.name, written.data, pair.source_file.resources)
    found = audited(
        report.options,
        Audited(pair.source_file, pair.source_asset, report.inputs.source.validity, pair.alignment),
        Audited(pair.reference_file, pair.reference_asset, report.quality.floor.validity),
        Audited(file, written.asset, refined.validity),
    )
    warnings = report.warnings + found.told.warnings
    told = {"asset": found.asset, "changes": found.changes, "warnings": warnings}
    return report.model_copy(update=told)


def _certificate(
    pair: Pair,
    solution: Solution,
    options: Options,
    written: WrittenFile,
    proven: ProvenDeviation | None,
) -> bytes | None:
    solved = solution.answer
    document = CertificateDocument(
        version=version("meshcone"),
        source_sha256=pair.source_file.sha256,
        reference_sha256=pair.reference_file.sha256,
        refined_sha256=written.record.sha256,
        source_resources=pair.source_file.resource_hashes,
        reference_resources=pair.reference_file.resource_hashes,
        candidate=solved.candidate,
        round_index=None if solved.final is None else solved.final.round_index,
        alignment=None if pair.alignment is None else pair.alignment.matrix.tolist(),
        options=options,
    )
    closeness = None if proven is None else Closeness(proven.extra, proven.missing)
    if solved.final is not None:
        division = solution.subdivision
        return CertificateFile.of(solved.final, document, closeness, division).to_bytes()
    return None if closeness is None else CertificateFile.of_kept(document, closeness).to_bytes()


def _tension(solution: Solution) -> Floats | None:
    final = solution.answer.final
    if final is None:
        return None
    return solution.problem.of_vertices(vertex_tension(final.multipliers, len(final.positions)))


def _timings(watch: Stopwatch, report: Report) -> Timings:
    stages = ("read", "align", "solve", "quality", "write", "audit")
    seconds = {name: watch.seconds.get(name, 0.0) for name in stages}
    return Timings(**seconds, total=watch.total, metrics=report.timings.metrics)


class _Tracker:
    """Turns stages and rounds into progress."""

    def __init__(self, callback: ProgressCallback | None) -> None:
        self._callback = callback
        self._round = 0
        self._rounds = 0

    def enter(self, stage: Stage) -> None:
        self._emit(stage, _STAGE_STARTS[stage])

    def level_done(self, faces: int, allowed: int) -> None:
        """Tell that faces are being added; the rounds that count come after."""
        start, end = _STAGE_STARTS["solve"], _STAGE_STARTS["write"]
        self._emit("solve", start + (end - start) / 2 * min(1.0, faces / allowed))

    def round_done(self, done: int, rounds: int) -> None:
        self._round, self._rounds = done, rounds
        start, end = _STAGE_STARTS["solve"], _STAGE_STARTS["write"]
        self._emit("solve", start + (end - start) * done / rounds)

    def _emit(self, stage: Stage, fraction: float) -> None:
        if self._callback is not None:
            self._callback(Progress(stage, self._round, self._rounds, fraction))
