"""Whether a refinement reached its tolerance, by the gate that stands for it."""

from __future__ import annotations

from meshcone.gates.units import sized, unit_for
from meshcone.options import WITHIN_GATE
from meshcone.report.report import Report
from meshcone.report.within import PlaceBeyond, WithinRecord


def is_within(report: Report) -> bool:
    """Whether the gate that stands for a tolerance passed."""
    return report.gates is not None and all(
        check.status == "pass" for check in report.gates.checks if check.key == WITHIN_GATE
    )


def within_record(report: Report, asked: str, attempts: int) -> WithinRecord:
    """What a report says of a tolerance that its options have as a gate."""
    assert report.deviation is not None  # noqa: S101 - no tolerance is taken without it
    inputs, options, radius = report.inputs, report.options, report.frame.radius
    formats = sized(
        inputs.source.format, inputs.reference.format, scaled=options.align == "similarity"
    )
    rule = options.gates[WITHIN_GATE]
    unit = unit_for(rule.unit, *formats)
    limit = rule.in_model_units(unit.length).max_model if rule.max is None else rule.max * radius
    assert limit is not None  # noqa: S101 - the gate has one of both
    places = [
        PlaceBeyond(on=each.on, position=each.position, distance_model=each.distance * radius)
        for each in report.quality.worst_points
        if each.distance * radius > limit
    ]
    reached = is_within(report)
    if not reached and not places:
        intervals = {"mesh": report.deviation.extra, "reference": report.deviation.missing}
        places = [
            PlaceBeyond(on=side, position=found.at, distance_model=found.lower_model)
            for side, found in intervals.items()
            if found is not None and found.lower_model > limit
        ]
    return WithinRecord(
        asked=asked,
        limit_model=limit,
        unit=unit.name,
        reached=reached,
        attempts=attempts,
        places=() if reached else tuple(places),
    )
