"""The proven deviation of two sampled surfaces, both ways, as a report states it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from meshcone.options.deviation import DeviationOptions
from meshcone.quality.deviation.area import AreaShare, area_beyond
from meshcone.quality.deviation.bars import AreaBars, Bars
from meshcone.quality.deviation.interval import Asked, Interval, searched_deviation
from meshcone.quality.deviation.leaves import Leaves
from meshcone.quality.deviation.points import Hints
from meshcone.quality.deviation.records import (
    AreaBeyond,
    Deviation,
    DistanceInterval,
    ProvenInterval,
    ShareInterval,
)
from meshcone.quality.deviation.search import Search
from meshcone.quality.deviation.sides import Encloses, Side, deviation_by_side
from meshcone.quality.sampled import SampledSurface
from meshcone.surface import Frame

# Pieces that telling outside from inside may cost.
_FOR_SIDES = 20_000


@dataclass(frozen=True)
class ProvenDeviation:
    """What was proven, and what proves it.

    Attributes:
        record: for the report.
        extra: how the mesh's faces were bounded by the reference's, both in the frame.
        missing: how the reference's were bounded by the mesh's.
    """

    record: Deviation
    extra: Leaves = field(repr=False)
    missing: Leaves = field(repr=False)


def prove_deviation(
    surface: SampledSurface,
    reference: SampledSurface,
    frame: Frame,
    chosen: DeviationOptions,
    bars: Bars,
    encloses: Encloses | None = None,
    tolerance: float = 0.0,
    is_apart: Callable[[], bool] = lambda: False,
) -> ProvenDeviation:
    """Bound how far either surface goes from the other.

    The closest faces that the metrics have found for the vertices are taken as hints.

    Args:
        surface: the judged mesh, in the frame.
        reference: in the frame.
        frame: that leads back to model units.
        chosen: how narrowly, and at what cost.
        bars: what the gates want to be told from it.
        encloses: which points of the frame a closed reference encloses.
        tolerance: how far the meshes may lie from the surfaces that are meant. Every interval
            is of those: wider by it at both ends.
        is_apart: whether no face of the mesh passes through the reference.
    """
    if reference.mesh.is_points:
        return _of_points(surface, reference, frame, _asked(chosen, bars.missing), tolerance)
    extra, search = _directed(surface, reference, _asked(chosen, bars.extra), tolerance)
    missing, _ = _directed(reference, surface, _asked(chosen, bars.missing), tolerance)
    sides = encloses and _by_side(search, encloses, is_apart, chosen, frame, tolerance)
    farther = max(extra, missing, key=lambda found: found.lower)
    upper = max(extra.upper, missing.upper)
    both = _asked(chosen, tuple(sorted({*bars.extra} & {*bars.missing})))
    return ProvenDeviation(
        record=Deviation(
            extra=_record(extra, extra.upper, frame, proven=extra.answered),
            missing=_record(missing, missing.upper, frame, proven=missing.answered),
            max=_record(farther, upper, frame, proven=both.answered_by(farther.lower, upper)),
            outside=sides and sides[0],
            inside=sides and sides[1],
            area_beyond=bars.area
            and _area(surface, reference, frame, chosen, bars.area, tolerance),
        ),
        extra=extra.leaves,
        missing=missing.leaves,
    )


def _of_points(
    surface: SampledSurface, points: SampledSurface, frame: Frame, asked: Asked, tolerance: float
) -> ProvenDeviation:
    """Bound how far points go from a mesh; how far it goes from them says nothing of it."""
    missing, _ = _directed(points, surface, asked, tolerance)
    # A certificate has both ways. This one costs nothing, and no report states it.
    extra, _ = _directed(surface, points, replace(asked, most_pieces=0, bars=()), tolerance)
    record = _record(missing, missing.upper, frame, proven=missing.answered)
    return ProvenDeviation(
        Deviation(extra=None, missing=record, max=None), extra.leaves, missing.leaves
    )


def _asked(chosen: DeviationOptions, bars: tuple[float, ...]) -> Asked:
    return Asked(chosen.width, chosen.share, chosen.pieces, bars)


def _directed(
    surface: SampledSurface, target: SampledSurface, asked: Asked, tolerance: float
) -> tuple[Interval, Search]:
    # What decides a bar of the wider interval decides both of these of the narrower one.
    bars = {abs(bar + shift) for bar in asked.bars for shift in (-tolerance, tolerance)}
    narrower = replace(asked, bars=tuple(sorted(bars)))
    found, search = searched_deviation(surface.mesh, target.mesh, narrower, _hints(surface, target))
    lower, upper = _widened(found.lower, found.upper, tolerance)
    answered = asked.answered_by(lower, upper)
    return replace(found, lower=lower, upper=upper, answered=answered), search


def _widened(lower: float, upper: float, tolerance: float) -> tuple[float, float]:
    return max(lower - tolerance, 0.0), upper + tolerance


def _hints(surface: SampledSurface, target: SampledSurface) -> Hints:
    nearest = np.zeros(len(surface.mesh.vertices), dtype=np.int64)
    found = surface.closest_on(target).faces[len(surface.samples.points) :]
    nearest[surface.mesh.used_vertices] = found
    return Hints(target.tree, nearest)


def _by_side(
    search: Search,
    encloses: Encloses,
    is_apart: Callable[[], bool],
    chosen: DeviationOptions,
    frame: Frame,
    tolerance: float,
) -> tuple[DistanceInterval, DistanceInterval]:
    made = search.pieces.count - search.pieces.faces
    most = min(chosen.pieces, made + _FOR_SIDES)
    asked = Asked(chosen.width, chosen.share, most)
    outside, inside = (
        _side(_wider(each, asked, tolerance), frame)
        for each in deviation_by_side(search, encloses, asked, is_apart)
    )
    return outside, inside


def _wider(found: Side, asked: Asked, tolerance: float) -> Side:
    lower, upper = _widened(found.lower, found.upper, tolerance)
    return replace(found, lower=lower, upper=upper, answered=asked.answered_by(lower, upper))


def _side(found: Side, frame: Frame) -> DistanceInterval:
    at = None
    if found.position is not None:
        x, y, z = map(float, frame.out_of(found.position))
        at = (x, y, z)
    return DistanceInterval(
        lower=found.lower,
        upper=found.upper,
        width=found.upper - found.lower,
        **_in_model_units(found.lower, found.upper, frame),
        at=at,
        proven=found.answered,
    )


def _in_model_units(lower: float, upper: float, frame: Frame) -> dict[str, float]:
    return {
        "lower_model": math.nextafter(lower * frame.radius, 0.0),
        "upper_model": math.nextafter(upper * frame.radius, math.inf) if upper else 0.0,
    }


def _area(
    surface: SampledSurface,
    reference: SampledSurface,
    frame: Frame,
    chosen: DeviationOptions,
    bars: AreaBars,
    uncertain: float,
) -> AreaBeyond:
    extra, missing = (
        area_beyond(
            mesh.mesh,
            other.mesh,
            bars.tolerance,
            bars.shares,
            chosen.share,
            chosen.pieces,
            _hints(mesh, other),
            uncertain,
        )
        for mesh, other in ((surface, reference), (reference, surface))
    )
    lower, upper = max(extra.lower, missing.lower), max(extra.upper, missing.upper)
    return AreaBeyond(
        lower=lower,
        upper=upper,
        width=upper - lower,
        proven=extra.decided and missing.decided,
        tolerance=bars.tolerance,
        tolerance_model=bars.tolerance * frame.radius,
        extra=_share(extra),
        missing=_share(missing),
    )


def _share(found: AreaShare) -> ShareInterval:
    return ShareInterval(
        lower=found.lower,
        upper=found.upper,
        width=found.upper - found.lower,
        proven=found.decided,
    )


def _record(found: Interval, upper: float, frame: Frame, *, proven: bool) -> ProvenInterval:
    x, y, z = map(float, frame.out_of(found.farthest.position))
    return ProvenInterval(
        lower=found.lower,
        upper=upper,
        width=upper - found.lower,
        **_in_model_units(found.lower, upper, frame),
        at=(x, y, z),
        proven=proven,
    )
