"""Where the last round began: the one thing of a certificate that is neither given nor optimal.

The rounds before are not solved again, so their result is free within bounds. The bounds
are loose on purpose: they catch what no rounds could have led to, and prove nothing else.
"""

from __future__ import annotations

from meshcone.certificate.checks import Check
from meshcone.report.report import Displacement
from meshcone.surface.arrays import Floats, row_lengths

# The last rounds move little: a round's start is about as far from the source as its end. The
# caps of earlier rounds may be exceeded by half, and smoothing may go and come back.
_LARGEST_RATIO = 4.0
_MARGIN = 0.01  # of the radius
_ROUNDING = 1e-9
_AGREEMENT = 1e-3
NOT_REPLAYED = "rounds before the last: not replayed"


def displacement_of(positions: Floats, source: Floats) -> Displacement:
    """Measure how far vertices (n, 3) lie from the source's, in the frame."""
    return displacement_by(row_lengths(positions - source))


def displacement_by(moves: Floats) -> Displacement:
    """Sum up how far vertices (n,) have moved, in the frame."""
    return Displacement(mean=float(moves.mean()), max=float(moves.max()))


def displacement_check(found: Displacement, stated: Displacement) -> Check:
    """Hold the displacement of the refined file against the one the report states."""
    pairs = ((found.mean, stated.mean), (found.max, stated.max))
    ok = all(abs(now - then) <= _AGREEMENT * now + _ROUNDING for now, then in pairs)
    words = f"vertices moved by {found.mean:.2g} of the radius on average, {found.max:.2g} at most"
    then = f"the report states {stated.mean:.2g} and {stated.max:.2g}"
    return Check("displacement", ok, f"{words}, as the report states" if ok else f"{words}; {then}")


def road_check(round_index: int, before: Floats, source: Floats, refined: Displacement) -> Check:
    """Hold the start of the last round against the source, and against where it ended.

    Args:
        round_index: the last round, counted from 0. The first starts at the source.
        before: (n, 3) where it started, in the frame.
        source: (n, 3) the source, in the frame.
        refined: how far the refined file lies from the source.
    """
    start = displacement_of(before, source)
    if round_index == 0:
        if not start.max <= _ROUNDING:
            words = f"the only round starts {start.max:.2g} of the radius away from the source"
            return Check("road", False, words)
        return Check("road", True, "the only round starts at the source")
    for found, end, which in (
        (start.mean, refined.mean, "on average"),
        (start.max, refined.max, "at most"),
    ):
        allowed = _LARGEST_RATIO * end + _MARGIN
        if not found <= allowed:
            words = (
                f"the last round starts {found:.2g} of the radius away from the source {which}, "
                f"but the refined file lies {end:.2g} away; allowed {allowed:.2g}"
            )
            return Check("road", False, words)
    words = f"round {round_index + 1} starts {start.max:.2g} of the radius from the source at most"
    return Check("road", True, f"{words}; {NOT_REPLAYED}")
