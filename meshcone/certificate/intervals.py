"""Whether the report states of the deviation what is proven of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.certificate.checks import Check
from meshcone.certificate.rewriting import require_same_structure
from meshcone.errors import InputError
from meshcone.pair import Pair
from meshcone.quality.deviation.records import Deviation, ProvenInterval
from meshcone.report.report import Report
from meshcone.report.statement import statement
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats

# Rounding on the way into the frame, in which the engine bounds, and out of it.
_ROUNDING = 1e-9
# How near to a surface a point has to be that is said to be on it, as a share of the radius.
_ON_SURFACE = 1e-6
# How wide a triangle may be that is left out for having no area, as a share of the radius: the
# halves of a seam may be rounded apart, and `written` allows no more than this either.
_NO_AREA = 5e-4


@dataclass(frozen=True)
class Bounds:
    """What was proven, in model units.

    Attributes:
        extra: no point of the refined surface is farther from the reference.
        missing: no point of the reference is farther from the refined surface.
    """

    extra: float
    missing: float


@dataclass(frozen=True)
class WrittenSurface:
    """The refined surface as its file stores it, where the alignment brings it.

    Attributes:
        mesh: its vertices welded, in model units.
        seam: how far a vertex of the file is from the one it is welded into, at most.
        reference: the reference, in model units.
    """

    mesh: Mesh
    seam: float
    reference: Mesh

    @staticmethod
    def of(pair: Pair, refined: bytes) -> WrittenSurface:
        """Read a refined file.

        Raises:
            InputError, LimitError: it cannot be read, is of another mesh than the source, or
                opens a triangle that is no face of the source.
        """
        written = pair.read_patched(refined)
        require_same_structure(pair, written)
        positions, seam = pair.written_in_model_units(written)
        _require_shut(pair.opened(written), min(2 * seam, _NO_AREA * pair.frame.radius))
        reference = pair.reference_asset
        return WrittenSurface(
            pair.source.moved_to(positions), seam, Mesh(reference.vertices, reference.faces)
        )


def _require_shut(opened: float, allowed: float) -> None:
    if not opened <= allowed:
        raise InputError(
            f"the refined file opens a triangle that is without area in the source: two of its "
            f"corners are at one place there, here no two are nearer than {opened:.3g}, "
            f"{allowed:.3g} are allowed. Nothing bounds such a triangle"
        )


def intervals_check(report: Report, found: Bounds, surface: WrittenSurface, pair: Pair) -> Check:
    """Hold every number of the report's section ``deviation``, and its statement, against proof.

    An upper end may be looser than what is proven here, a lower end has to be attained.

    Args:
        report: which has such a section.
        found: what is proven here.
        surface: the refined file's, and the reference's.
        pair: which knows the radius, and what the unit is called.
    """
    stated = report.deviation
    assert stated is not None  # noqa: S101 - there is nothing to check otherwise
    margin = surface.seam + _ROUNDING * pair.frame.radius
    fault = (
        _not_proven(stated, found, margin)
        or _not_attained(stated, surface, margin + _ON_SURFACE * pair.frame.radius)
        or _inconsistent(stated, pair.frame.radius, margin)
    )
    if fault is None and report.statement != statement(stated, pair.unit(report.options.gates)):
        fault = "the report's statement is not what its intervals say"
    return Check("deviation", fault is None, fault or "the report's intervals are those found here")


def _not_proven(stated: Deviation, found: Bounds, margin: float) -> str | None:
    for name in ("extra", "missing"):
        told, proven = getattr(stated, name).upper_model, getattr(found, name)
        if not told >= proven - margin:
            return f"'{name}' is proven to be {proven:.3g} at most, the report states {told:.3g}"
    return None


def _not_attained(stated: Deviation, surface: WrittenSurface, margin: float) -> str | None:
    mesh, reference = surface.mesh, surface.reference
    for name, here, there in (("extra", mesh, reference), ("missing", reference, mesh)):
        told: ProvenInterval = getattr(stated, name)
        at = np.array([told.at])
        if not (off := _distance(here, at)) <= margin:
            return f"the farthest point of '{name}' is {off:.3g} away from the surface it is on"
        if not (away := _distance(there, at)) >= told.lower_model - margin:
            return (
                f"the farthest point of '{name}' is {away:.3g} away from the other surface, "
                f"the report states {told.lower_model:.3g}"
            )
    return None


def _distance(mesh: Mesh, at: Floats) -> float:
    return float(SurfaceTree(mesh).closest(at).distances[0])


def _inconsistent(stated: Deviation, radius: float, margin: float) -> str | None:
    farther = max(stated.extra, stated.missing, key=lambda told: told.lower)
    upper = max(stated.extra.upper, stated.missing.upper)
    if (stated.max.lower, stated.max.upper, stated.max.at) != (farther.lower, upper, farther.at):
        return "the report's 'max' is not the larger of both directions"
    for told in (stated.extra, stated.missing, stated.max):
        in_model_units = ((told.lower, told.lower_model), (told.upper, told.upper_model))
        if not all(abs(end * radius - model) <= margin for end, model in in_model_units):
            return "the report's ends in model units are not those in radii"
        if told.width != told.upper - told.lower:
            return "the report's width is not the upper end minus the lower end"
    return None
