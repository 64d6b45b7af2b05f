"""The proven deviation of two sampled surfaces, both ways, as a report states it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from meshcone.options.deviation import DeviationOptions
from meshcone.quality.deviation.area import AreaShare, area_beyond
from meshcone.quality.deviation.bars import AreaBars, Bars
from meshcone.quality.deviation.interval import Asked, Interval, directed_deviation
from meshcone.quality.deviation.leaves import Leaves
from meshcone.quality.deviation.points import Hints
from meshcone.quality.deviation.records import (
    AreaBeyond,
    Deviation,
    ProvenInterval,
    ShareInterval,
)
from meshcone.quality.sampled import SampledSurface
from meshcone.surface import Frame


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
) -> ProvenDeviation:
    """Bound how far either surface goes from the other.

    The closest faces that the metrics have found for the vertices are taken as hints.

    Args:
        surface: the judged mesh, in the frame.
        reference: in the frame.
        frame: that leads back to model units.
        chosen: how narrowly, and at what cost.
        bars: what the gates want to be told from it.
    """
    extra = _directed(surface, reference, _asked(chosen, bars.extra))
    missing = _directed(reference, surface, _asked(chosen, bars.missing))
    farther = max(extra, missing, key=lambda found: found.lower)
    upper = max(extra.upper, missing.upper)
    both = _asked(chosen, tuple(sorted({*bars.extra} & {*bars.missing})))
    return ProvenDeviation(
        record=Deviation(
            extra=_record(extra, extra.upper, frame, proven=extra.answered),
            missing=_record(missing, missing.upper, frame, proven=missing.answered),
            max=_record(farther, upper, frame, proven=both.answered_by(farther.lower, upper)),
            area_beyond=bars.area and _area(surface, reference, frame, chosen, bars.area),
        ),
        extra=extra.leaves,
        missing=missing.leaves,
    )


def _asked(chosen: DeviationOptions, bars: tuple[float, ...]) -> Asked:
    return Asked(chosen.width, chosen.share, chosen.pieces, bars)


def _directed(surface: SampledSurface, target: SampledSurface, asked: Asked) -> Interval:
    return directed_deviation(surface.mesh, target.mesh, asked, _hints(surface, target))


def _hints(surface: SampledSurface, target: SampledSurface) -> Hints:
    nearest = np.zeros(len(surface.mesh.vertices), dtype=np.int64)
    found = surface.closest_on(target).faces[len(surface.samples.points) :]
    nearest[surface.mesh.used_vertices] = found
    return Hints(target.tree, nearest)


def _area(
    surface: SampledSurface,
    reference: SampledSurface,
    frame: Frame,
    chosen: DeviationOptions,
    bars: AreaBars,
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
        lower_model=math.nextafter(found.lower * frame.radius, 0.0),
        upper_model=math.nextafter(upper * frame.radius, math.inf) if upper else 0.0,
        at=(x, y, z),
        proven=proven,
    )
