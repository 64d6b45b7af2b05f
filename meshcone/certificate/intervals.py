"""Whether the report states of the deviation what is proven of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.certificate.checks import Check
from meshcone.certificate.rewriting import require_same_structure
from meshcone.errors import InputError
from meshcone.options.deviation import DeviationOptions
from meshcone.pair import Pair
from meshcone.quality.deviation.area import share_decided
from meshcone.quality.deviation.bars import Bars, bars_of
from meshcone.quality.deviation.interval import Asked
from meshcone.quality.deviation.records import Deviation, ShareInterval
from meshcone.quality.deviation.triangles import Triangles
from meshcone.report.report import Report
from meshcone.report.statement import statement
from meshcone.surface import Mesh, SurfaceTree
from meshcone.written import WrittenVertices

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
        tolerance: how far the two may lie from the surfaces that are meant.
    """

    mesh: Mesh
    seam: float
    reference: Mesh
    tolerance: float

    @property
    def uncertain(self) -> float:
        """How far the file's surfaces may lie from these meshes; a bound is wider by it."""
        return self.seam + self.tolerance

    @staticmethod
    def of(pair: Pair, refined: bytes) -> WrittenSurface:
        """Read a refined file.

        Raises:
            InputError, LimitError: it cannot be read, is of another mesh than the source, or
                opens a triangle that is no face of the source.
        """
        written = pair.read_patched(refined)
        require_same_structure(pair, written)
        vertices, radius = WrittenVertices.of(pair, written), pair.frame.radius
        _require_shut(pair.opened(written), min(2 * vertices.seam, _NO_AREA * radius))
        reference = pair.reference_asset
        return WrittenSurface(
            mesh=pair.source.moved_to(vertices.positions),
            seam=vertices.seam,
            reference=Mesh(reference.vertices, reference.faces, reference.is_points),
            tolerance=pair.tolerance * radius + vertices.rounding,
        )


def _require_shut(opened: float, allowed: float) -> None:
    if not opened <= allowed:
        raise InputError(
            f"the refined file opens a triangle that is without area in the source: two of its "
            f"corners are at one place there, here no two are nearer than {opened:.3g}, "
            f"{allowed:.3g} are allowed. Nothing bounds such a triangle"
        )


def intervals_check(report: Report, found: Bounds, surface: WrittenSurface, pair: Pair) -> Check:
    """Hold the report's section ``deviation``, and its statement, against proof.

    An upper end may be looser than what is proven here, a lower end has to be attained, and a
    flag has to follow from ends, options and gates. The line names what is not checked.

    Args:
        report: which has such a section.
        found: what is proven here.
        surface: the refined file's, and the reference's.
        pair: which knows the radius, and what the unit is called.
    """
    stated = report.deviation
    assert stated is not None  # noqa: S101 - there is nothing to check otherwise
    radius = pair.frame.radius
    margin = _ROUNDING * radius
    near = margin + _ON_SURFACE * radius
    bars = bars_of(pair.gates(report.options), radius)
    fault = (
        _not_one_way(stated, surface)
        or _not_proven(stated, found, margin)
        or _not_attained(stated, surface, near)
        or _inconsistent(stated, radius, margin)
        or _wrong_sides(stated, found, margin, near)
        or _wrong_area(stated, found, bars, radius, near)
        or _wrong_flag(stated, report.options.deviation, bars)
    )
    if fault is None and report.statement != statement(stated, pair.unit(report.options)):
        fault = "the report's statement is not what its intervals say"
    return Check("deviation", fault is None, fault or _AGREES + _not_checked(stated))


_AGREES = "the report's intervals are those found here"


def _not_checked(stated: Deviation) -> str:
    left = []
    if stated.outside or stated.inside:
        left.append("which side of the reference a point is on")
    if stated.area_beyond:
        left.append("the share of area beyond the tolerance, but for whether there is any")
    return f"; {' and '.join(left)}: not checked" if left else ""


def _not_one_way(stated: Deviation, surface: WrittenSurface) -> str | None:
    """Of points alone one way is stated, and of surfaces both."""
    ways = (stated.extra, stated.max)
    if surface.reference.is_points and ways != (None, None):
        return "the report bounds how far the mesh goes beyond points, which is unknown"
    if not surface.reference.is_points and None in ways:
        return "the report states one way of the deviation without the other"
    return None


def _not_proven(stated: Deviation, found: Bounds, margin: float) -> str | None:
    for name in ("extra", "missing"):
        told, proven = getattr(stated, name), getattr(found, name)
        if told is not None and not told.upper_model >= proven - margin:
            return (
                f"'{name}' is proven to be {proven:.3g} at most, the report states "
                f"{told.upper_model:.3g}"
            )
    return None


def _not_attained(stated: Deviation, surface: WrittenSurface, near: float) -> str | None:
    mesh, reference = surface.mesh, surface.reference
    of_mesh = [
        (name, told, mesh, reference)
        for name in ("extra", "outside", "inside")
        if (told := getattr(stated, name)) is not None
    ]
    for name, told, here, there in (*of_mesh, ("missing", stated.missing, reference, mesh)):
        if told.at is None:
            if told.lower_model == 0:
                continue
            return f"'{name}' names no point that is {told.lower_model:.3g} away"
        at = np.array(told.at)
        # The search's answer is a point of the surface, whether or not there is a closer one.
        if not (off := float(SurfaceTree(here).closest(at[None]).distances[0])) <= near:
            return f"the farthest point of '{name}' is {off:.3g} away from the surface it is on"
        # Of the two surfaces as the files mean them: 0 of any two is true.
        away = max(Triangles(there).distance_at_least(at) - surface.uncertain, 0.0)
        if not (told.lower_model == 0 or away >= told.lower_model - near):
            return (
                f"the farthest point of '{name}' is {away:.3g} away from the other surface, "
                f"the report states {told.lower_model:.3g}"
            )
    return None


def _wrong_sides(stated: Deviation, found: Bounds, margin: float, near: float) -> str | None:
    """The farthest point is on one of the sides, and neither goes farther than the whole does."""
    sides = {name: getattr(stated, name) for name in ("outside", "inside")}
    told = {name: side for name, side in sides.items() if side is not None}
    if not told or stated.extra is None:
        return "the report states 'outside' or 'inside', but points have no sides" if told else None
    if len(told) == 1:
        return "the report states one side of the reference without the other"
    for name, side in told.items():
        if not side.lower_model <= found.extra + margin:
            return f"'{name}' begins beyond {found.extra:.3g}, which no point exceeds"
    upper = max(side.upper_model for side in told.values())
    if not upper >= stated.extra.lower_model - near:
        return "neither 'outside' nor 'inside' reaches as far as 'extra' does"
    return None


def _wrong_area(
    stated: Deviation, found: Bounds, bars: Bars, radius: float, near: float
) -> str | None:
    """There is area beyond a tolerance that a point exceeds, and none where no point does."""
    told = stated.area_beyond
    if stated.extra is None:
        return None if told is None else "the report states 'area_beyond' for points"
    if (told is None) != (bars.area is None):
        return "'area_beyond' is stated without a gate, or a gate on it without it"
    if told is None or bars.area is None:
        return None
    tolerance = bars.area.tolerance
    if (told.tolerance, told.tolerance_model) != (tolerance, tolerance * radius):
        return "the tolerance of 'area_beyond' is not that of its gate"
    for name in ("extra", "missing"):
        share: ShareInterval = getattr(told, name)
        if getattr(stated, name).lower_model > told.tolerance_model + near and not share.upper > 0:
            return f"'{name}' goes beyond the tolerance, 'area_beyond' states that it does not"
        if getattr(found, name) <= told.tolerance_model - near and not share.lower <= 0:
            return f"'{name}' stays within the tolerance, 'area_beyond' states that it does not"
    both = (told.extra, told.missing)
    larger = tuple(max(getattr(each, end) for each in both) for end in ("lower", "upper"))
    if (told.lower, told.upper) != larger:
        return "'area_beyond' is not the larger of both directions"
    for share in (told, *both):
        if not 0 <= share.lower <= share.upper <= 1 or share.width != share.upper - share.lower:
            return "'area_beyond' is no interval of shares, or its width is not that of its ends"
    return None


def _wrong_flag(stated: Deviation, chosen: DeviationOptions, bars: Bars) -> str | None:
    """Its ends say whether an interval is as narrow as asked for, or decides the gates."""
    shared = tuple(sorted({*bars.extra} & {*bars.missing}))
    asked = {"extra": bars.extra, "missing": bars.missing, "max": shared}
    for name in ("extra", "missing", "max", "outside", "inside"):
        told = getattr(stated, name)
        if told is None:
            continue
        ask = Asked(chosen.width, chosen.share, chosen.pieces, asked.get(name, ()))
        if told.proven != ask.answered_by(told.lower, told.upper):
            return f"whether '{name}' is proven is not what its ends say"
    area = stated.area_beyond
    if area is None or bars.area is None:
        return None
    for share in (area.extra, area.missing):
        if share.proven != share_decided(share.lower, share.upper, bars.area.shares, chosen.share):
            return "whether 'area_beyond' is proven is not what its ends say"
    if area.proven != (area.extra.proven and area.missing.proven):
        return "whether 'area_beyond' is proven is not what its directions say"
    return None


def _inconsistent(stated: Deviation, radius: float, margin: float) -> str | None:
    if stated.extra is not None and stated.max is not None:
        farther = max(stated.extra, stated.missing, key=lambda told: told.lower)
        ends = farther.lower, max(stated.extra.upper, stated.missing.upper), farther.at
        if (stated.max.lower, stated.max.upper, stated.max.at) != ends:
            return "the report's 'max' is not the larger of both directions"
    every = (stated.extra, stated.missing, stated.max, stated.outside, stated.inside)
    for told in (each for each in every if each is not None):
        in_model_units = ((told.lower, told.lower_model), (told.upper, told.upper_model))
        if not all(abs(end * radius - model) <= margin for end, model in in_model_units):
            return "the report's ends in model units are not those in radii"
        if told.width != told.upper - told.lower:
            return "the report's width is not the upper end minus the lower end"
    return None
