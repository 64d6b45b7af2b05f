"""Deciding what may be said of a refinement, or of a mesh beside its reference."""

from __future__ import annotations

import math

from meshcone.program.answer import RefinedPositions
from meshcone.quality.harm import ROUNDING, STANDARD_ERRORS
from meshcone.quality.records import Metrics
from meshcone.report.report import Agreement, Outcome

# The largest of many roundings, in single precision far from the middle.
_LARGEST_ROUNDING = 1e-6


def decide_outcome(
    before: Metrics,
    after: Metrics,
    floor: Metrics,
    samples: int,
    largest_move: float,
    solved: RefinedPositions,
    *,
    is_opposed: bool = False,
) -> Outcome:
    """Name the outcome by the mean point-to-surface distance.

    The rule, in this order:

    1. ``reference_copy``: the program was anchored at the reference's own vertices;
    2. ``misaligned``: source and reference do not fit, and nothing was solved;
    3. ``indistinguishable``: input and refined are both at the floor, and face the right way;
    4. ``kept``: every answer was worse than the input somewhere, which is returned;
    5. ``unchanged``: no vertex moved by more than 1e-7 of the radius;
    6. ``undecided``: input and refined differ by no more than the floor and twice the standard
       error of the difference: of the same places before and after, where the answer was held
       against its input, else of independent samples;
    7. ``improved`` or ``worse``.

    Args:
        before: the input's metrics.
        after: the refined mesh's.
        floor: the reference's own.
        samples: drawn from each surface.
        largest_move: of any vertex, relative to the radius.
        solved: what the solver answered, and why it kept the input if it did.
        is_opposed: whether the input, or a part of it, faces the other way.
    """
    if solved.copied_reference:
        return "reference_copy"
    if solved.misaligned is not None:
        return "misaligned"
    if at_floor(before, floor) and at_floor(after, floor) and not is_opposed:
        return "indistinguishable"
    if solved.kept_because:
        return "kept"
    if largest_move <= ROUNDING:
        return "unchanged"
    was, now = before.point_to_surface.mean, after.point_to_surface.mean
    if solved.gain is None:
        gain = was - now
        error = math.hypot(_standard_error(before, samples), _standard_error(after, samples))
    else:
        gain, error = solved.gain.mean, solved.gain.error
    noise = floor.point_to_surface.mean + ROUNDING + STANDARD_ERRORS * error
    if abs(gain) <= noise or (gain > 0) is not (now < was):
        return "undecided"
    return "improved" if now < was else "worse"


def decide_agreement(measured: Metrics, floor: Metrics, *, is_opposed: bool) -> Agreement:
    """Say whether a mesh can be told from its reference.

    Args:
        measured: the mesh's metrics.
        floor: the reference's own.
        is_opposed: whether the mesh, or a part of it, faces the other way: distances do not
            see it, and what is drawn does.
    """
    return "indistinguishable" if at_floor(measured, floor) and not is_opposed else "different"


def at_floor(measured: Metrics, floor: Metrics) -> bool:
    """Whether a mesh lies as close to the reference as the reference to itself, everywhere.

    Point-to-surface distances are exact, so that their floor is rounding, and so are the
    margins: 1e-7 of the radius for the mean, 1e-6 for the largest. A small part that is missing
    or astray is in the largest alone, of which the vertices of both are a part.
    """
    found, least = measured.point_to_surface, floor.point_to_surface
    nowhere_far = found.max <= least.max + _LARGEST_ROUNDING
    return nowhere_far and found.mean <= least.mean + ROUNDING


def _standard_error(metrics: Metrics, samples: int) -> float:
    """Standard error of the mean distance over the samples of both surfaces.

    It is that of independent draws; low-discrepancy samples vary less.
    """
    distances = metrics.point_to_surface
    return math.sqrt(max(distances.rms**2 - distances.mean**2, 0.0) / (2 * samples))
