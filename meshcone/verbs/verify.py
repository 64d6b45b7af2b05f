"""Re-checking a refinement from its files, without a solver.

The last round's program is rebuilt from source, reference and options; the certificate
supplies the point it started from, its optimum and its multipliers. Nothing the report
says of the program is believed: each number is computed again. What this proves, and what
it does not, is in ``docs/certificate.md``. :mod:`meshcone.verbs.replay` solves again.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from meshcone.assets import Asset
from meshcone.certificate.checks import Check, Verification
from meshcone.certificate.closeness import closeness_checks
from meshcone.certificate.dividing import divide
from meshcone.certificate.file import CertificateFile, most_bytes, read_certificate
from meshcone.certificate.identity import identity_checks
from meshcone.certificate.metrics import metrics_check
from meshcone.certificate.optimality import optimality_checks
from meshcone.certificate.placement import place
from meshcone.certificate.rewriting import compare_with_rewritten
from meshcone.certificate.road import (
    displacement_by,
    displacement_check,
    displacement_of,
    road_check,
)
from meshcone.certificate.settings import settings_check
from meshcone.certificate.stated import files_checks, solver_check, within_checks
from meshcone.errors import InputError, LimitError
from meshcone.files import MeshFile
from meshcone.formulation import CentroidFormulation, SurfaceFormulation, formulate
from meshcone.json_text import DuplicateNameError, NotFiniteError, parse_json
from meshcone.options import Options
from meshcone.pair import Pair, read_pair
from meshcone.program.answer import FinalProgram
from meshcone.report.reading import READABLE, parse_report
from meshcone.report.report import Report
from meshcone.surface import Mesh


def read_report(data: bytes, name: str) -> Report:
    """Read the report of a refinement.

    Raises:
        InputError: it is none, or of another version or of a measurement.
    """
    try:
        return parse_report(data)
    except (DuplicateNameError, NotFiniteError) as error:
        raise InputError(f"this is not a MeshCone report: {error}", file=name) from None
    except (ValueError, RecursionError):
        raise InputError(f"this is not a MeshCone report{_what_it_is(data)}", file=name) from None


def _what_it_is(data: bytes) -> str:
    """Say what a document claims to be, if it claims anything."""
    try:
        document = parse_json(data)
    except (ValueError, RecursionError):
        return ""
    schema = document.get("schema") if isinstance(document, dict) else None
    if not isinstance(schema, str):
        return ""
    if schema in READABLE:
        if document.get("mode", "refine") != "refine":
            return " of a refinement: nothing was refined, so that there is nothing to verify"
        return f" of a refinement, although it says it is one: {schema}"
    return f" that this program reads: it is of the schema {ascii(schema)[1:-1]:.60}"


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
    pair = read_pair(source, reference, report.options).under(report.options)
    most = _most_bytes(pair, report.options, refined)
    stored = read_certificate(certificate.data, certificate.name, most)
    round_index = stored.document.round_index
    checks = [
        *identity_checks(report, stored.document, source, reference, refined),
        *files_checks(report, pair, refined),
        solver_check(report),
        settings_check(report.options, ranges=round_index is not None),
    ]
    try:
        pair, placed = place(pair, report.options, report.alignment)
    except InputError as error:
        return Verification((*checks, Check("placed", False, str(error))))
    checks += placed
    try:
        pair, division = divide(pair, stored.division, report, refined.data)
    except (InputError, LimitError) as error:
        return Verification((*checks, Check("division", False, str(error))))
    checks += division
    closeness = closeness_checks(report, stored, pair, refined.data)
    if round_index is None:
        answer = _check_kept(report, pair, refined)
    else:
        answer = _check_answer(report, stored, round_index, pair, refined)
    within = within_checks(report, pair)
    return Verification((*checks, *closeness, *within, *answer))


def _most_bytes(pair: Pair, options: Options, refined: MeshFile) -> int:
    """Bound a certificate by the meshes it is about, the refined one where it has more faces."""
    meshes: list[Mesh | Asset] = [pair.source, pair.reference]
    if options.detail.wanted:
        with suppress(InputError, LimitError):  # what is wrong with it, a check says
            meshes.append(pair.read_patched(refined.data))
    vertices, faces = (sum(len(getattr(m, of)) for m in meshes) for of in ("vertices", "faces"))
    return most_bytes(vertices, faces, options)


def _check_kept(report: Report, pair: Pair, refined: MeshFile) -> Iterator[Check]:
    """Check that the source came back as it was, and what the report then says of it."""
    same = refined.data == pair.source_file.data
    words = "the refined file is the source, byte for byte"
    yield Check("kept", same, words if same else "the source was not kept: the file is another")
    if report.certificate is not None:
        yield Check("report", False, "the report states a last round, the certificate has none")
    if same:
        still = displacement_of(pair.source.vertices, pair.source.vertices)
        yield displacement_check(still, report.displacement)
        yield metrics_check(report, pair.source, pair.reference)
        yield Check("road", True, "the source was kept; that no round is better: not replayed")


def _check_answer(
    report: Report, stored: CertificateFile, round_index: int, pair: Pair, refined: MeshFile
) -> Iterator[Check]:
    problem = formulate(pair, report.options)
    try:
        vertices = len(problem.into_program(pair.source.vertices))
        final = _rebuild(problem, stored, round_index, vertices)
    except InputError as error:
        yield Check("program", False, str(error))
        return
    optimum = problem.out_of_program(final.positions)
    answer = problem.settled(optimum)
    try:
        rewriting = compare_with_rewritten(pair, answer, refined.data, optimum)
    except (InputError, LimitError) as error:
        yield Check("written", False, str(error))
        return
    yield from optimality_checks(report, stored, problem, final, rewriting, pair.source)
    stored_at = rewriting.vertices
    moved = displacement_by(stored_at.away_from(pair.source.vertices))
    yield displacement_check(moved, report.displacement)
    yield metrics_check(report, pair.source.moved_to(stored_at.in_frame), pair.reference)
    start = problem.started_at(final.before)
    yield road_check(final.round_index, start, pair.source.vertices, moved)


def _rebuild(
    problem: SurfaceFormulation | CentroidFormulation,
    stored: CertificateFile,
    round_index: int,
    vertices: int,
) -> FinalProgram:
    if len(stored.positions) != vertices:
        raise InputError("the certificate is of a mesh with another number of vertices")
    return problem.rebuild(
        stored.document.candidate,
        round_index,
        stored.before,
        stored.positions,
        stored.multipliers,
    )
