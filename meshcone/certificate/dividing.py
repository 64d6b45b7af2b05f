"""Whether a refined file is the source with its faces divided, and all else as it was."""

from __future__ import annotations

import numpy as np

from meshcone.assets import Asset, WritePolicy
from meshcone.certificate.attributes import attributes_check
from meshcone.certificate.checks import Check
from meshcone.certificate.division import DivisionRecord
from meshcone.certificate.rewriting import require_same_structure
from meshcone.detail.records import DetailRecord
from meshcone.errors import InputError
from meshcone.options.detail import DetailOptions
from meshcone.pair import Pair
from meshcone.report.report import Report


def divide(
    pair: Pair, stored: DivisionRecord | None, report: Report, refined: bytes
) -> tuple[Pair, list[Check]]:
    """Divide the source as a certificate says.

    Args:
        pair: as sent, the source moved as aligned.
        stored: the record; None where no face was divided.
        report: which states how many were.
        refined: the refined file.

    Returns:
        The pair with its source divided, of which everything else is checked, and the checks.

    Raises:
        InputError, LimitError: the record is no division of the source, the source cannot be
            divided so, or the refined file cannot be read or is of another mesh.
    """
    told = report.detail
    if stored is None:
        if told is not None:
            _require_undivided(told, report.options.detail, len(pair.source_asset.faces))
        return pair, []
    subdivision = stored.checked(pair.source_asset.faces, pair.source_asset.charts)
    swapped = int(np.count_nonzero(subdivision.swapped))
    if swapped and report.options.detail.flips != "chart":
        raise InputError("diagonals are swapped on sides of faces, and no option asks for it")
    counts = subdivision.sources, len(subdivision.parents), int(subdivision.divided.sum()), swapped
    if told is None or counts != (
        *(told.faces_before, told.faces_after),
        *(told.divided, told.swapped),
    ):
        raise InputError("the report states other numbers of faces than the division has")
    _require_allowed(told, report.options.detail)
    written = pair.read_patched(refined)
    expected = len(pair.source_asset.triangles) + len(subdivision.parents) - subdivision.sources
    if len(written.triangles) != expected:  # nothing is written that large for a forger
        raise InputError(
            f"the refined file has {len(written.triangles):,} triangles, the source divided so "
            f"has {expected:,}"
        )
    divided = pair.divided(subdivision, report.options)
    require_same_structure(divided, written)
    whole = subdivision.sources - np.count_nonzero(subdivision.unswapped().divided)
    words = (
        f"{len(subdivision.parents) - whole:,} faces tile {subdivision.sources - whole:,} of the "
        f"{subdivision.sources:,} of the source, and those that share a side divide it alike: "
        "shown by whole numbers"
    )
    if swapped:
        words += (
            f"; then {swapped:,} of these took corners from each other, within one material, "
            "with the borders of charts and the sense of every triangle of texture coordinates "
            "kept, so that a chart covers what it covered"
        )
    attributes = attributes_check(pair.source_asset, _unmoved(divided, written), subdivision)
    return divided, [Check("division", True, words), attributes]


def _require_undivided(told: DetailRecord, asked: DetailOptions, faces: int) -> None:
    """Check what is said of added faces where the certificate has none."""
    if told.divided or told.swapped or told.faces_after != told.faces_before:
        raise InputError("the report states that faces were divided, the certificate does not")
    if told.faces_before != faces:
        words = f"the source has {faces:,} faces with area, the report states {told.faces_before:,}"
        raise InputError(words)
    _require_allowed(told, asked)


def _require_allowed(told: DetailRecord, asked: DetailOptions) -> None:
    allowed = asked.faces_allowed(told.faces_before)
    if told.faces_allowed != allowed or not asked.wanted:
        raise InputError(
            f"the options allow {allowed:,} faces, the report states {told.faces_allowed:,}"
        )


def _unmoved(pair: Pair, written: Asset) -> Asset:
    """The refined file with its vertices back where those of the source are.

    Only there its polygons are sure to be split into the triangles that the source's are.
    """
    there = pair.source_asset
    if np.array_equal(written.triangles, there.triangles):
        return written
    used = written.weld >= 0
    vertices = written.vertices.copy()
    vertices[written.weld[used]] = there.positions[used]
    back = pair.read_patched(written.patched(vertices, WritePolicy(normals="keep")))
    if not np.array_equal(back.triangles, there.triangles):
        raise InputError("the refined file has other faces than the source")
    return back
