"""Deciding what may be said of a refinement."""

from __future__ import annotations

from meshcone.quality.records import Metrics
from meshcone.report import Outcome

# Below this share of the radius a move is the rounding of the file's own numbers.
UNCHANGED_BELOW = 1e-7
# Point-to-surface distances are exact and their floor is 0; what is left is the spread
# of their mean over the samples, well under this share of it at 5,000 samples.
_SAMPLING_SHARE = 0.02


def decide_outcome(
    before: Metrics, after: Metrics, floor: Metrics, largest_move: float, copied: bool
) -> Outcome:
    """Name the outcome by the mean point-to-surface distance.

    The rule, in this order:

    1. ``reference_copy``: the program was anchored at the reference's own vertices;
    2. ``unchanged``: no vertex moved by more than 1e-7 of the radius;
    3. ``indistinguishable``: the means of input and refined differ by less than 2 % of the
       input's plus the floor's, so the samples cannot tell them apart;
    4. ``improved`` or ``worse``.
    """
    if copied:
        return "reference_copy"
    if largest_move <= UNCHANGED_BELOW:
        return "unchanged"
    was, now = before.point_to_surface.mean, after.point_to_surface.mean
    margin = _SAMPLING_SHARE * was + floor.point_to_surface.mean + UNCHANGED_BELOW
    if abs(now - was) <= margin:
        return "indistinguishable"
    return "improved" if now < was else "worse"
