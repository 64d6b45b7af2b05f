"""Re-checking a refinement from its files, without a solver.

The last round's program is rebuilt from source, reference and options; the certificate
supplies the point it started from, its optimum and its multipliers. Nothing the report
says of the program is believed: each number is computed again. What this proves, and what
it does not, is in ``docs/certificate.md``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import ValidationError

from meshcone.certificate.certify import certify
from meshcone.certificate.file import CertificateFile, read_certificate
from meshcone.certificate.rewriting import Rewriting, compare_with_rewritten
from meshcone.errors import InputError, LimitError
from meshcone.files import MeshFile
from meshcone.formulation import CentroidFormulation, SurfaceFormulation, formulate
from meshcone.options import Options
from meshcone.pair import Pair, read_pair
from meshcone.program.answer import FinalProgram
from meshcone.program.tension import vertex_tension
from meshcone.report.report import CertificateRecord, Matrix, Report
from meshcone.surface.alignment import Alignment
from meshcone.surface.similarity import is_similarity

# Whoever forges a certificate may also state a tolerance: this is the loosest believed.
_LOOSEST_TOLERANCE = 1e-3
# Two machines may round a stored position to different neighbours, but a vertex farther
# than this share of the radius from where it belongs is elsewhere.
_LARGEST_OFFSET = 5e-4
_ROUNDING = 1e-9
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


@dataclass(frozen=True, repr=False)
class Verification:
    """All checks of one refinement; true if every one holds."""

    checks: tuple[Check, ...]

    def __bool__(self) -> bool:
        return self.ok

    def __str__(self) -> str:
        return "\n".join(
            f"{'ok' if check.ok else 'FAILED':<7}{check.name:<15} {check.words}"
            for check in self.checks
        )

    def __repr__(self) -> str:
        failed = [check.name for check in self.checks if not check.ok]
        if not failed:
            return f"<Verification ok: {len(self.checks)} checks>"
        count = f"{len(failed)} of {len(self.checks)} checks"
        return f"<Verification FAILED: {count}: {', '.join(failed)}>"

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)


def read_report(data: bytes, name: str) -> Report:
    """Read the report of a refinement.

    Raises:
        InputError: it is none, or one without a certificate.
    """
    try:
        report = Report.model_validate_json(data)
    except ValidationError:
        raise InputError("this is not a MeshCone report", file=name) from None
    if report.certificate is None:
        raise InputError("the report has no certificate: the input was kept as it was", file=name)
    return report


def verify(
    report: Report,
    certificate: MeshFile,
    source: MeshFile,
    reference: MeshFile,
    refined: MeshFile,
) -> Verification:
    """Check that ``refined`` is what ``source`` and ``reference`` lead to.

    Args:
        report: the report; see :func:`read_report`.
        certificate: its certificate file.
        source: as it was sent.
        reference: as it was sent.
        refined: as it was returned.

    Raises:
        InputError, LimitError: the certificate, source or reference cannot be read at all.
    """
    stored = read_certificate(certificate.data, certificate.name)
    inputs, document = report.inputs, stored.document
    checks = [
        _identity("source file", source, inputs.source.sha256, document.source_sha256),
        _identity("reference file", reference, inputs.reference.sha256, document.reference_sha256),
        _identity("refined file", refined, report.output.sha256, document.refined_sha256),
        *_resources(source, inputs.source.resources, document.source_resources),
        *_resources(reference, inputs.reference.resources, document.reference_resources),
        _same("version", report.version == document.version),
        _same("options", report.options == document.options),
        _same("alignment", _stated_alignment(report) == document.alignment),
    ]
    unplaced = read_pair(source, reference).under(report.options)
    try:
        pair = _placed(unplaced, report.options, document.alignment)
    except InputError as error:
        return Verification((*checks, Check("placed", False, str(error))))
    return Verification((*checks, *_check_answer(report, stored, pair, refined)))


def _stated_alignment(report: Report) -> Matrix | None:
    return None if report.alignment is None else report.alignment.matrix


def _placed(pair: Pair, options: Options, matrix: Matrix | None) -> Pair:
    """Move the source as the certificate says; which motion is best is not checked.

    Raises:
        InputError: it says so without having been asked to, or by something that is not the
            motion that was asked for.
    """
    if (matrix is None) != (options.align == "none"):
        raise InputError("the certificate's alignment is not the one the options ask for")
    if matrix is None:
        return pair
    found = np.array(matrix)
    if not is_similarity(found, rigid=options.align == "rigid"):
        raise InputError(f"the certificate's alignment is not {options.align}")
    return pair.placed(Alignment(found, "none", before=0.0, after=0.0))


def _check_answer(
    report: Report, stored: CertificateFile, pair: Pair, refined: MeshFile
) -> list[Check]:
    problem = formulate(pair, report.options)
    try:
        final = _rebuild(problem, stored, len(pair.source.vertices))
    except InputError as error:
        return [Check("program", False, str(error))]
    answer = problem.out_of_program(final.positions)
    try:
        rewriting = compare_with_rewritten(pair, answer, refined.data)
    except (InputError, LimitError) as error:
        return [Check("written", False, str(error))]
    found = certify(
        final,
        problem.into_program(rewriting.positions),
        report.options.solver.tolerance,
        problem.magnification,
    )
    bound = min(found.tolerance, _LOOSEST_TOLERANCE)
    return [
        _bounded("feasible", found.optimum.primal, bound, "largest cone violation"),
        _bounded("stationary", found.optimum.dual, bound, "dual residual"),
        _bounded("no gap", found.optimum.gap, bound, "duality gap"),
        _bounded("complementary", found.optimum.complementarity, bound, "slack of an active cone"),
        _written(found, rewriting, bound),
        _tension(final, stored),
        _agreement(found, report.certificate),
    ]


def _rebuild(
    problem: SurfaceFormulation | CentroidFormulation, stored: CertificateFile, vertices: int
) -> FinalProgram:
    if len(stored.positions) != vertices:
        raise InputError("the certificate is of a mesh with another number of vertices")
    return problem.rebuild(
        stored.document.candidate,
        stored.document.round_index,
        stored.before,
        stored.positions,
        stored.multipliers,
    )


def _identity(name: str, file: MeshFile, in_report: str, in_certificate: str) -> Check:
    return _hashed(name, file.name, file.sha256, in_report, in_certificate)


def _resources(
    file: MeshFile, in_report: dict[str, str], in_certificate: dict[str, str]
) -> list[Check]:
    """Compare the files that came with a mesh, as far as they are here.

    One that is needed and missing is noticed in reading; a texture nobody kept is no fault.
    """
    found = file.resource_hashes
    return [
        _hashed("resource", name, found[name], in_report.get(name), in_certificate.get(name))
        for name in sorted({*in_report, *in_certificate} & found.keys())
    ]


def _hashed(
    name: str, file: str, found: str, in_report: str | None, in_certificate: str | None
) -> Check:
    ok = found == in_report == in_certificate
    hash_of = "the hash" if ok else "another hash than"
    return Check(name, ok, f"{file} has {hash_of} report and certificate state")


def _same(name: str, ok: bool) -> Check:
    words = f"report and certificate state the same {name}"
    return Check(name, ok, words if ok else words.replace("the same", "another"))


def _bounded(name: str, value: float, bound: float, what: str) -> Check:
    return Check(name, value <= bound, f"{what} {value:.2g}, allowed {bound:.2g}")


def _written(found: CertificateRecord, rewriting: Rewriting, tolerance: float) -> Check:
    allowed = min(2 * rewriting.precision + _ROUNDING, _LARGEST_OFFSET)
    if rewriting.offset > allowed:
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
            abs(now - then) <= _AGREEMENT * (found.tolerance + abs(then))
            for now, then in zip(_numbers(found), _numbers(claimed), strict=True)
        )
    )
    words = "the report's residuals and cones are those found here"
    return Check("report", same, words if same else words.replace("are those", "are not those"))


_APPROXIMATE = {"optimum", "written", "precision"}


def _numbers(record: CertificateRecord) -> list[float]:
    return [
        record.precision,
        *record.optimum.model_dump().values(),
        *record.written.model_dump().values(),
    ]
