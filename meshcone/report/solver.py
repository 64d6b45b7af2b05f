"""What a report says of the solver: its rounds, and what it could not do."""

from __future__ import annotations

from collections.abc import Mapping

from meshcone.notices import Code, WarningRecord, warning
from meshcone.options import Options
from meshcone.program.answer import RefinedPositions
from meshcone.program.diagnostics import SolverReport


def solver_report(options: Options, solved: RefinedPositions) -> SolverReport:
    """Record the rounds, and whether SCS confirmed the last."""
    asked = [record.info for record in solved.rounds if record.info is not None]
    last = solved.rounds[-1].info if solved.rounds else None
    return SolverReport(
        formulation=options.formulation,
        form=options.centroid.form if options.formulation == "centroid" else "reduced",
        effort=options.effort,
        candidate=solved.candidate,
        solved=all(info.solved for info in asked),
        confirmed=last is not None and last.solved,
        iterations=sum(info.iterations for info in asked),
        confirm_seconds=solved.confirm_seconds,
        rounds=solved.rounds,
        regions=solved.regions,
    )


def solver_warnings(
    solver: SolverReport, solved: RefinedPositions, unmet: Mapping[str, int]
) -> list[WarningRecord]:
    """Warn of rounds that did not end, of a source that was returned, and why it was.

    Args:
        solver: of the same answer.
        solved: the answer.
        unmet: how many cones of each kind the source does not satisfy.
    """
    warnings = [
        warning(
            Code.SOLVER_UNFINISHED,
            "refined",
            f"round {record.round}: the solver stopped after {record.info.iterations} iterations "
            "without meeting its tolerance",
            where=f"round {record.round}",
        )
        for record in solver.rounds
        if record.info is not None and not record.info.solved
    ]
    if solved.misaligned is not None:
        words = "Source and reference do not fit, and the source is returned as it was. "
        warnings.append(warning(Code.POSE_MISFIT, "pair", words + solved.misaligned))
    if solved.kept_because:
        words = (
            "The source is returned as it was, because every answer found was worse somewhere. "
            f"In the one closest to the reference {'; '.join(solved.kept_because)}."
        )
        warnings.append(warning(Code.SOLVER_KEPT_INPUT, "refined", words))
    if solved.final is None and unmet:
        kinds = ", ".join(f"{kind} at {count:,} places" for kind, count in unmet.items())
        words = f"The source is returned, and does not satisfy what was asked for: {kinds}."
        warnings.append(warning(Code.SOLVER_CONES_UNMET, "refined", words))
    return warnings
