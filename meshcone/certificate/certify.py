"""Describing how optimal an answer is, at the solver's and at the file's precision."""

from __future__ import annotations

from meshcone.formulation import Formulated
from meshcone.program.answer import FinalProgram
from meshcone.program.certificate import residuals
from meshcone.program.multipliers import active_cones
from meshcone.report.report import CertificateRecord
from meshcone.written import WrittenVertices


def certify(
    problem: Formulated, final: FinalProgram, written: WrittenVertices, tolerance: float
) -> CertificateRecord:
    """Recompute an answer's residuals from its program.

    Args:
        problem: the formulation of the pair.
        final: the last round's program, its optimum and multipliers.
        written: the vertices that the refined file stores.
        tolerance: what each residual must not exceed.
    """
    optimum = residuals(final.objective, final.families, final.positions, final.multipliers)
    active = active_cones(final.families, final.multipliers)
    stored = problem.into_program(written.in_frame)
    offsets = written.away_from(problem.out_of_program(final.positions))
    return CertificateRecord(
        tolerance=tolerance,
        holds=optimum.worst <= tolerance,
        round=final.round_index + 1,
        cones={family.kind: len(family) for family in final.families},
        active=active,
        relaxation_is_optimal=not final.multipliers,
        optimum=optimum,
        written=residuals(final.objective, final.families, stored, final.multipliers),
        precision=float(offsets.max(initial=0.0)),
    )
