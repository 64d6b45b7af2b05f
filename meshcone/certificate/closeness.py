"""How close the refined surface and the reference are, proven again from the files.

This is the one claim that holds whatever options, alignment, rounds or report say: every
triangle of both surfaces is looked at, and nothing that is stored is believed but how they
are divided, which can only make the bound looser.
"""

from __future__ import annotations

from collections.abc import Iterator

from meshcone.certificate.checks import Check
from meshcone.certificate.file import CertificateFile, Closeness
from meshcone.certificate.intervals import Bounds, WrittenSurface, intervals_check
from meshcone.errors import InputError, LimitError
from meshcone.options import Options
from meshcone.pair import Pair
from meshcone.quality.deviation.check import check_leaves
from meshcone.quality.deviation.interval import Asked, directed_deviation
from meshcone.report.report import Report
from meshcone.report.statement import within
from meshcone.surface import Frame


def closeness_checks(
    report: Report, certificate: CertificateFile, pair: Pair, refined: bytes
) -> Iterator[Check]:
    """Prove how far either surface goes from the other, and hold the report against it.

    Where neither report nor certificate has anything to say of it, it is searched for here.

    Args:
        report: whose section ``deviation`` is looked at.
        certificate: whose record of leaves is looked at.
        pair: source and reference, the source moved as aligned.
        refined: the refined file.
    """
    stated, stored = report.deviation, certificate.closeness
    if (stated is None) != (stored is None):
        has, has_not = ("report", "certificate") if stored is None else ("certificate", "report")
        words = f"the {has} states how close the surfaces are, the {has_not} does not"
        yield Check("closeness", False, words)
        return
    try:
        surface = WrittenSurface.of(pair, refined)
        found = _proven(surface, stored) if stored else _searched(surface, report.options)
    except (InputError, LimitError) as error:
        yield Check("closeness", False, str(error))
        return
    unit = pair.unit(report.options)
    moved = "" if pair.alignment is None else "moved as aligned, "
    how = "proven without a search" if stored else "found by a search, because no proof is stored"
    extra = None if surface.reference.is_points else found.extra
    yield Check("closeness", True, f"{moved}{within(extra, found.missing, unit)}: {how}")
    if stated is not None:
        yield intervals_check(report, found, surface, pair)
    elif (fault := _unproven(report, certificate)) is not None:
        yield Check("deviation", False, fault)


def _unproven(report: Report, certificate: CertificateFile) -> str | None:
    """Why a report without intervals, and a certificate without leaves, are not as they came."""
    if report.statement is not None:
        return "the report makes a statement, and has no intervals that it could follow from"
    first = certificate.document.schema_ == "meshcone.certificate/1"  # which proved none
    if report.options.deviation.prove and not first:
        return "the options ask for proven intervals, and neither report nor certificate has them"
    return None


def _proven(surface: WrittenSurface, stored: Closeness) -> Bounds:
    mesh, reference = surface.mesh, surface.reference
    bounds = []
    for name, here, there in (("extra", mesh, reference), ("missing", reference, mesh)):
        try:
            bound = check_leaves(here, there, getattr(stored, name))
            bounds.append(bound + surface.uncertain)
        except InputError as error:
            raise InputError(f"the record of '{name}' proves nothing: {error}") from None
    return Bounds(*bounds)


def _searched(surface: WrittenSurface, options: Options) -> Bounds:
    chosen = options.deviation
    asked = Asked(chosen.width * Frame.of(surface.reference).radius, chosen.share, chosen.pieces)
    extra = directed_deviation(surface.mesh, surface.reference, asked).upper
    missing = directed_deviation(surface.reference, surface.mesh, asked).upper
    return Bounds(extra + surface.uncertain, missing + surface.uncertain)
