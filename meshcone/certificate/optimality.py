"""Whether the refined file is the optimum of its last round."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from meshcone.certificate.certify import certify
from meshcone.certificate.checks import Check, bounded
from meshcone.certificate.file import CertificateFile
from meshcone.certificate.rewriting import Rewriting
from meshcone.formulation import Formulated
from meshcone.program.answer import FinalProgram
from meshcone.program.tension import vertex_tension
from meshcone.report.report import CertificateRecord, Report
from meshcone.surface import Frame, Mesh

# Whoever forges a certificate may also state a tolerance: this is the loosest believed.
_LOOSEST_TOLERANCE = 1e-3
# What a residual may amount to in the answer, where that is larger than the program's variable.
_LOOSEST_ANSWER = 2e-3
# A source smaller than this share of the reference is measured by its own size: tolerances are
# shares of the reference's, and would leave its vertices free.
_SMALL_SOURCE = 0.1
# Two machines may round a stored position to different neighbours, but a vertex farther
# than this share of the radius from where it belongs is elsewhere.
_LARGEST_OFFSET = 5e-4
_ROUNDING = 1e-9
_AGREEMENT = 1e-3
_APPROXIMATE = {"optimum", "written", "precision"}


def optimality_checks(
    report: Report,
    stored: CertificateFile,
    problem: Formulated,
    final: FinalProgram,
    rewriting: Rewriting,
    source: Mesh,
) -> Iterator[Check]:
    """Compute the residuals of the last round's optimum, and compare the refined file with it.

    Args:
        report: whose certificate section is compared with what is found.
        stored: the certificate file.
        problem: the formulation of the pair.
        final: the last round's program as the certificate has it.
        rewriting: how the refined file compares with the optimum written into the source.
        source: in the frame.
    """
    found = certify(problem, final, rewriting.vertices, report.options.solver.tolerance)
    bound = min(found.tolerance, _LOOSEST_TOLERANCE, _LOOSEST_ANSWER / problem.magnification)
    length = bound * min(1.0, Frame.of(source).radius / _SMALL_SOURCE)
    yield bounded("feasible", found.optimum.primal, length, "largest cone violation")
    yield bounded("stationary", found.optimum.dual, length, "dual residual")
    yield bounded("no gap", found.optimum.gap, bound, "duality gap")
    yield bounded("complementary", found.optimum.complementarity, length, "slack of an active cone")
    yield _written(found, rewriting, length)
    yield _tension(final, stored)
    yield _agreement(found, report.certificate)


def _written(found: CertificateRecord, rewriting: Rewriting, tolerance: float) -> Check:
    allowed = min(2 * rewriting.precision + _ROUNDING, _LARGEST_OFFSET)
    if not rewriting.offset <= allowed:
        words = (
            f"the refined file is {rewriting.offset:.2g} of the radius away from the optimum "
            f"written into the source, allowed {allowed:.2g}"
        )
        return Check("written", False, words)
    same = "the refined file is the source with the optimum written into it"
    how = "byte for byte" if rewriting.identical else "as far as its positions go"
    return Check(
        "written",
        found.written.primal <= tolerance + 2 * rewriting.precision,
        f"{same}, {how}: to {rewriting.precision:.2g} of the radius, "
        f"with cone violations up to {found.written.primal:.2g}",
    )


def _tension(final: FinalProgram, stored: CertificateFile) -> Check:
    expected = vertex_tension(final.multipliers, len(final.positions))
    ok = bool(np.allclose(expected, stored.tension, rtol=_ROUNDING, atol=0))
    words = "the tension is that of the multipliers"
    return Check("tension", ok, words if ok else words.replace("is that", "is not that"))


def _agreement(found: CertificateRecord, claimed: CertificateRecord | None) -> Check:
    same = (
        claimed is not None
        and found.model_dump(exclude=_APPROXIMATE) == claimed.model_dump(exclude=_APPROXIMATE)
        and all(
            # By the smaller of both: what is infinite would allow anything.
            abs(now - then) <= _AGREEMENT * (found.tolerance + min(abs(now), abs(then)))
            for now, then in zip(_numbers(found), _numbers(claimed), strict=True)
        )
    )
    words = "the report's residuals and cones are those found here"
    return Check("report", same, words if same else words.replace("are those", "are not those"))


def _numbers(record: CertificateRecord) -> list[float]:
    return [
        record.precision,
        *record.optimum.model_dump().values(),
        *record.written.model_dump().values(),
    ]
