"""Describing how optimal an answer is, at the solver's and at the file's precision."""

from __future__ import annotations

from meshcone.program.answer import FinalProgram
from meshcone.program.certificate import residuals
from meshcone.program.multipliers import active_cones
from meshcone.report.report import CertificateRecord
from meshcone.surface.arrays import Floats, row_lengths


def certify(
    final: FinalProgram, written: Floats, tolerance: float, magnification: float
) -> CertificateRecord:
    """Recompute an answer's residuals from its program.

    Args:
        final: the last round's program, its optimum and multipliers.
        written: (n, 3) the positions the refined file stores, mapped into the program's
            own frame.
        tolerance: what each residual must not exceed.
        magnification: length in the reference's frame of a unit of the program's own.
    """
    optimum = residuals(final.objective, final.families, final.positions, final.multipliers)
    active = active_cones(final.families, final.multipliers)
    offsets = row_lengths(written - final.positions)
    return CertificateRecord(
        tolerance=tolerance,
        holds=optimum.worst <= tolerance,
        round=final.round_index + 1,
        cones={family.kind: len(family) for family in final.families},
        active=active,
        relaxation_is_optimal=not final.multipliers,
        optimum=optimum,
        written=residuals(final.objective, final.families, written, final.multipliers),
        precision=magnification * float(offsets.max(initial=0.0)),
    )
