"""Certificates made to order: a report, a certificate and a file that agree with each other.

A forger has the engine, and solves whatever program leads to the mesh they want. What the
forged report says of hashes, residuals, displacement and metrics is true of the forged file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from meshcone.certificate.certify import certify
from meshcone.certificate.file import CertificateFile, Closeness
from meshcone.certificate.rewriting import compare_with_rewritten
from meshcone.certificate.road import displacement_of
from meshcone.files import MeshFile
from meshcone.formulation import CentroidFormulation, SurfaceFormulation, formulate
from meshcone.options import parse_options
from meshcone.pair import Pair, read_pair
from meshcone.program.answer import FinalProgram
from meshcone.program.round_solver import solve_round
from meshcone.report.report import AlignmentRecord
from meshcone.report.scoring import Scorer
from meshcone.report.statement import statement
from meshcone.surface.alignment import Alignment, distances_under
from meshcone.surface.arrays import Floats
from tests.unit.engine.evidence import Evidence

Formulation = SurfaceFormulation | CentroidFormulation


@dataclass(frozen=True)
class Forgery:
    """What a forger wants, for an honest source and reference.

    Attributes:
        options: that report and certificate state.
        before: where the last round is said to have started, (n, 3), from the honest pair.
        optimum: (n, 3) handed in as the optimum; by default the round's own.
        round_index: the round, counted from 0.
        candidate: the setting.
        motion: (4, 4) alignment.
    """

    options: dict[str, Any]
    before: Callable[[Pair], Floats] = lambda pair: pair.source.vertices
    optimum: Callable[[Formulation, FinalProgram], Floats] | None = None
    round_index: int = 4
    candidate: str = "as set"
    motion: Floats | None = None

    def of(self, honest: Evidence) -> Evidence:
        """Forge report, certificate and refined file."""
        options = parse_options(self.options)
        pair = read_pair(honest.source, honest.reference, options).under(options)
        aligned = None if self.motion is None else _alignment(pair, self.motion, options.seed)
        if self.motion is not None:
            pair = pair.placed(Alignment(self.motion, "icp", 0.0, 0.0))
        problem = formulate(pair, options)
        final = self._final(pair, problem)
        optimum = problem.out_of_program(final.positions)
        answer = problem.settled(optimum)
        refined = MeshFile(honest.refined.name, pair.patched(answer))
        vertices = compare_with_rewritten(pair, answer, refined.data, optimum).vertices
        written = vertices.in_frame
        scorer = Scorer(pair.source, pair.reference, options)
        measured = scorer.refined(pair.source.moved_to(written))
        uncertain = pair.tolerance + vertices.uncertain
        proven = scorer.deviation(pair.frame, pair.gates(options), uncertain)
        assert proven is not None
        closeness = Closeness(proven.extra, proven.missing)
        tolerance = options.solver.tolerance
        report = honest.report.model_copy(
            update={
                "options": options,
                "alignment": aligned,
                "certificate": certify(problem, final, vertices, tolerance),
                "deviation": proven.record,
                "statement": statement(proven.record, pair.unit(options)),
                "displacement": displacement_of(written, pair.source.vertices),
                "quality": scorer.quality(measured, pair.frame),
                "solver": honest.report.solver.model_copy(update={"candidate": self.candidate}),
            }
        )
        document = honest.certificate.document.model_copy(
            update={
                "options": options,
                "alignment": None if aligned is None else aligned.matrix,
                "candidate": self.candidate,
                "round_index": self.round_index,
            }
        )
        certificate = CertificateFile.of(final, document, closeness)
        forged = replace(honest, report=report, certificate=certificate, refined=refined)
        return forged.with_forged_hashes()

    def _final(self, pair: Pair, problem: Formulation) -> FinalProgram:
        before = self.before(pair)
        final = problem.rebuild(self.candidate, self.round_index, before, before, {})
        if self.optimum is not None:
            return replace(final, positions=self.optimum(problem, final))
        options = problem.problems.options if isinstance(problem, SurfaceFormulation) else None
        assert options is not None
        objective, families = final.objective, final.families
        solved = solve_round(objective, families, before, options.solver)  # type: ignore[arg-type]
        return replace(final, positions=solved.positions, multipliers=solved.multipliers)


def _alignment(pair: Pair, motion: Floats, seed: int) -> AlignmentRecord:
    before, after = distances_under(*pair.in_model_units(), motion, seed)
    matrix = motion.tolist()
    return AlignmentRecord(matrix=matrix, method="icp", before=before, after=after, note=None)


def anywhere(pair: Pair) -> Floats:
    """Random points for the source's vertices, (n, 3) in the frame."""
    return np.random.default_rng(1).normal(size=pair.source.vertices.shape)
