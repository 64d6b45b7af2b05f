"""Running a formulation from the first round to the last."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from meshcone.options import Options
from meshcone.program.centroid import CentroidObjective, choose_anchor
from meshcone.program.cones import ConeFamily, EdgeCaps
from meshcone.program.conic import ConicProgram, assemble, everything
from meshcone.program.correspondence import PreparedReference, SourceStructure, round_objective
from meshcone.program.diagnostics import ProgramSizes, RoundRecord
from meshcone.program.model import solve_centroid_model
from meshcone.program.relaxation import solve_relaxation
from meshcone.program.scs_solver import PrimalDual, ScsRun, solve
from meshcone.surface import Mesh, sample_surface
from meshcone.surface.arrays import Floats

RoundCallback = Callable[[int, int], None]

# A multiplier below this share of the largest is the solver's rounding.
_ACTIVE_SHARE = 1e-6


@dataclass(frozen=True)
class RefinedPositions:
    """Where a formulation put the vertices.

    Attributes:
        positions: (n, 3) in the reference's frame.
        rounds: what happened in each round.
        copied_reference: the program was anchored at the reference's own vertices, so its
            answer is a copy of the reference and no refinement.
    """

    positions: Floats
    rounds: list[RoundRecord]
    copied_reference: bool


def refine_centroid(source: Mesh, reference: Mesh, options: Options) -> RefinedPositions:
    """Solve the paper's program and undo its shrink.

    Args:
        source: in the reference's frame.
        reference: in its own frame.
        options: ``options.centroid`` and ``options.solver`` are read.
    """
    chosen = options.centroid
    samples = sample_surface(reference, chosen.samples, options.seed, method="random")
    anchor, copied = choose_anchor(source, reference)
    objective = CentroidObjective(samples.points.mean(axis=0), anchor, chosen.regularization)
    caps = EdgeCaps.uniform(source, chosen.edge_cap)
    if chosen.form == "cvxpy":
        optimum, record = solve_centroid_model(objective, caps, options.solver, source.vertices)
    else:
        program = assemble(objective, everything([caps]))
        run = solve(program, options.solver)
        optimum = run.solution.x.reshape(-1, 3)
        record = _record(1, program, run, [caps], source.vertices)
    return RefinedPositions(objective.undo_shrink(optimum), [record], copied)


def refine_surface(
    source: Mesh, reference: Mesh, options: Options, on_round: RoundCallback | None = None
) -> RefinedPositions:
    """Solve the surface program round by round.

    Args:
        source: in the reference's frame.
        reference: in its own frame.
        options: ``options.surface`` and ``options.solver`` are read.
        on_round: called with the rounds done and the rounds in all.
    """
    chosen = options.surface
    prepared = PreparedReference.of(reference, len(source.vertices), options.seed)
    structure = SourceStructure.of(source, prepared, chosen.noise_scale)
    families: list[ConeFamily] = [EdgeCaps.relative(source, chosen.edge_cap)]
    moving, records = source, []
    for index in range(len(chosen.fairness)):
        objective = round_objective(index, moving, prepared, structure, chosen)
        relaxed = solve_relaxation(objective, moving.vertices.ravel())
        program = assemble(objective, everything(families))
        start = PrimalDual(relaxed, np.zeros(len(program.b)), program.b - program.A @ relaxed)
        run = solve(program, options.solver, start)
        records.append(_record(index + 1, program, run, families, moving.vertices))
        moving = moving.moved_to(run.solution.x.reshape(-1, 3))
        if on_round is not None:
            on_round(index + 1, len(chosen.fairness))
    return RefinedPositions(moving.vertices, records, copied_reference=False)


def _record(
    number: int,
    program: ConicProgram,
    run: ScsRun,
    families: Sequence[ConeFamily],
    before: Floats,
) -> RoundRecord:
    after = run.solution.x.reshape(-1, 3)
    return RoundRecord(
        round=number,
        sizes=_sizes(program),
        info=run.info,
        active_cones=_active_cones(program, run.solution.y),
        largest_violation=max(
            (float(family.violation(after).max(initial=0)) for family in families), default=0.0
        ),
        movement=float(np.sqrt(np.mean(np.sum((after - before) ** 2, axis=1)))),
        history=run.history,
    )


def _sizes(program: ConicProgram) -> ProgramSizes:
    cones: dict[str, int] = {}
    rows = {"zero": 0, "linear": 0, "second_order": 0}
    for selection in program.selections:
        family = selection.family
        cones[family.kind] = cones.get(family.kind, 0) + len(selection.which)
        rows[family.cone] += selection.size
    diagonal = int(np.count_nonzero(program.P.diagonal()))
    return ProgramSizes(
        variables=len(program.c),
        constraints=len(program.b),
        cones=cones,
        nnz_A=program.A.nnz,
        nnz_P=(program.P.nnz + diagonal) // 2,
        **rows,
    )


def _active_cones(program: ConicProgram, multipliers: Floats) -> dict[str, int]:
    threshold = _ACTIVE_SHARE * max(float(np.abs(multipliers).max(initial=0)), 1.0)
    active: dict[str, int] = {}
    row = 0
    for selection in program.selections:
        block = multipliers[row : row + selection.size]
        norms = np.linalg.norm(block.reshape(-1, selection.family.dimension), axis=1)
        kind = selection.family.kind
        active[kind] = active.get(kind, 0) + int(np.count_nonzero(norms > threshold))
        row += selection.size
    return active
