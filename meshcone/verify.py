"""Re-checking a refinement from its files, without a solver.

The last round's program is rebuilt from source, reference and options; the certificate
supplies the point it started from, its optimum and its multipliers. Nothing the report
says is believed: each number is computed again.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from pydantic import ValidationError

from meshcone.certificate_file import CertificateFile, read_certificate
from meshcone.certify import certify
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.formulation import formulate
from meshcone.pair import Pair, read_pair
from meshcone.report import CertificateRecord, Report

# A file that stores positions no better than this cannot be told from another answer.
_COARSEST_PRECISION = 5e-4
_FINEST_PRECISION = 1e-6
_AGREEMENT = 1e-3


@dataclass(frozen=True)
class Check:
    """One thing that was checked.

    Attributes:
        name: short and stable.
        ok: whether it holds.
        words: what was found, and against what bound.
    """

    name: str
    ok: bool
    words: str


@dataclass(frozen=True)
class Verification:
    """All checks of one refinement."""

    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)


def verify(
    report_json: bytes,
    certificate: MeshFile,
    source: MeshFile,
    reference: MeshFile,
    refined: MeshFile,
) -> Verification:
    """Check that ``refined`` is what ``source`` and ``reference`` lead to.

    Args:
        report_json: the report.
        certificate: its certificate file.
        source: as it was sent.
        reference: as it was sent.
        refined: as it was returned.

    Raises:
        InputError, LimitError: a file cannot be read at all.
    """
    try:
        report = Report.model_validate_json(report_json)
    except ValidationError:
        raise InputError("this is not a MeshCone report") from None
    stored = read_certificate(certificate.data, certificate.name)
    inputs, document = report.inputs, stored.document
    checks = [
        _identity("source file", source, inputs.source.sha256, document.source_sha256),
        _identity("reference file", reference, inputs.reference.sha256, document.reference_sha256),
        _identity("refined file", refined, report.output.sha256, document.refined_sha256),
        Check(
            "options",
            report.options == document.options,
            "report and certificate were made with the same options"
            if report.options == document.options
            else "the report's options are not the certificate's",
        ),
    ]
    pair = read_pair(source, reference)
    return Verification((*checks, *_check_program(report, stored, pair, refined)))


def _check_program(
    report: Report, stored: CertificateFile, pair: Pair, refined: MeshFile
) -> list[Check]:
    problem = formulate(pair, report.options)
    document = stored.document
    if stored.positions.shape != pair.source.vertices.shape:
        return [Check("vertices", False, "the certificate is of a mesh with other vertices")]
    try:
        final = problem.rebuild(
            document.candidate,
            document.round_index,
            stored.before,
            stored.positions,
            stored.multipliers,
        )
        written = problem.into_program(pair.written_positions(refined.data))
    except InputError as error:
        return [Check("program", False, str(error))]
    found = certify(final, written, report.options.solver.tolerance)
    return [
        _residual("feasible", found.optimum.primal, found.tolerance, "largest cone violation"),
        _residual("stationary", found.optimum.dual, found.tolerance, "dual residual"),
        _residual("no gap", found.optimum.gap, found.tolerance, "duality gap"),
        _written(found, report.certificate),
        _agreement(found, report.certificate),
    ]


def _identity(name: str, file: MeshFile, in_report: str, in_certificate: str) -> Check:
    found = hashlib.sha256(file.data).hexdigest()
    ok = found == in_report == in_certificate
    words = f"{file.name} is the file the certificate names"
    return Check(name, ok, words if ok else f"{file.name} is not the file the certificate names")


def _residual(name: str, value: float, bound: float, what: str) -> Check:
    return Check(name, value <= bound, f"{what} {value:.2g}, allowed {bound:.2g}")


def _written(found: CertificateRecord, claimed: CertificateRecord | None) -> Check:
    stated = 0.0 if claimed is None else claimed.precision
    bound = min(max(2 * stated, _FINEST_PRECISION), _COARSEST_PRECISION)
    return Check(
        "written",
        found.precision <= bound and found.written.primal <= found.tolerance + 2 * bound,
        f"the refined file is within {found.precision:.2g} of the optimum, allowed {bound:.2g}; "
        f"its largest cone violation is {found.written.primal:.2g}",
    )


def _agreement(found: CertificateRecord, claimed: CertificateRecord | None) -> Check:
    if claimed is None:
        return Check("report", False, "the report has no certificate")
    same = (
        found.cones == claimed.cones
        and found.active == claimed.active
        and all(
            abs(now - then) <= _AGREEMENT * found.tolerance + _AGREEMENT * abs(then)
            for now, then in zip(_numbers(found), _numbers(claimed), strict=True)
        )
    )
    words = "the report's residuals and cones are those found here"
    return Check("report", same, words if same else "the report states other residuals or cones")


def _numbers(record: CertificateRecord) -> list[float]:
    return [
        value
        for residuals in (record.optimum, record.written)
        for value in (residuals.primal, residuals.dual, residuals.gap)
    ]
