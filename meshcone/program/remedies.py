"""What may still be done for an answer that harms its input: guard rounds, and giving back.

Guard rounds (``guards.py``) mend faces that are amiss. Where an answer is worse than the input
in a few places, these are given back to the input and held there, and one round more fits the
rest to them. Both are decided by what is counted, never by a clock: results repeat.
"""

from __future__ import annotations

import numpy as np

from meshcone.program.attempt import Attempt, Countdown
from meshcone.program.infeasibility import ContradictionError
from meshcone.quality.harm import Examined, HarmCheck
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools

# Guard rounds follow where more than so many faces, and than this share of them, are amiss. Where
# it is more than that share they mend too little, as on a sheet, half of whose faces are opposed.
# They may cost this much of the distance: of its mean, its 95th percentile and the largest of
# samples and vertices.
_FEWEST_AMISS, _AMISS_SHARE, _MOST_AMISS_SHARE = 4, 0.001, 0.25
_MENDING_COST = 1.02
_LARGEST_COST = 1.1  # what is measured of the largest depends on which samples meet it
_HOPELESS = 1.5  # from which the largest does not come back in the last guard round
# How often places are given back, each time more of them; of an answer of which more than this
# share is given back, or less than that share of the gain is left, another is better.
_TIMES, _MOST_GIVEN_BACK, _GAIN_LEFT = 4, 0.3, 0.8


def guarded_end(
    attempt: Attempt, harm: HarmCheck, found: Examined
) -> tuple[Attempt, Examined] | None:
    """Go on with guard rounds where much is amiss; None where that mends nothing.

    Each smooths more than the one before. Of those that cost next to nothing in distance, and for
    an answer that harms of all, the one that leaves least amiss is the last.

    Args:
        attempt: completed.
        harm: the input.
        found: what the attempt's answer looks like.
    """
    faces = len(harm.source.faces)
    fewest = max(_FEWEST_AMISS, _AMISS_SHARE * faces)
    if not (attempt.guards and fewest < found.amiss <= _MOST_AMISS_SHARE * faces):
        return None
    guarded, ends = attempt.guarded(), list[tuple[int, Examined]]()
    while guarded.rounds_left:
        # Only the last round has half-spaces, which may take longer than all that was before.
        if guarded.rounds_left == 1 and ends and not _serves(ends[-1][1], found, _HOPELESS):
            break
        try:
            guarded.step(Countdown(None, 0))
        except ContradictionError:  # of a tolerance band, which follows the round's own start
            break
        if guarded.finish is None or guarded.finish.solution.converged:
            ends.append((len(guarded.records), harm.examine(guarded.positions)))
    good = [end for end in ends if _mends(end[1], found) and _serves(end[1], found)]
    if not good:
        return None
    rounds, mended = min(good, key=lambda end: end[1].amiss)
    if guarded.finish is None or rounds < len(guarded.records):
        guarded = guarded.shortened(rounds)
        mended = harm.examine(guarded.complete(Countdown(None, 0)).solution.positions)
    assert guarded.finish is not None  # noqa: S101 - solved just now, or the last of them all
    better = _mends(mended, found) and _serves(mended, found)
    return (guarded, mended) if better and guarded.finish.solution.converged else None


def given_back(
    attempt: Attempt, harm: HarmCheck, found: Examined
) -> tuple[Attempt, Examined] | None:
    """Give places where an answer harms back to the input; None where that does not help.

    Args:
        attempt: completed.
        harm: the input.
        found: what the attempt's answer looks like.
    """
    wanted = max(_GAIN_LEFT * harm.gain(found).mean, 0.0)
    held = np.zeros(len(harm.source.vertices), dtype=bool)
    for time in range(_TIMES):
        more = harm.places(found) & ~held
        if time:  # what was held has moved the harm to its rim
            more = _with_neighbours(harm.source, more)
        if not (more & ~held).any() or np.mean(held | more) > _MOST_GIVEN_BACK:
            return None
        held |= more
        again = attempt.holding(held)
        try:
            solution = again.complete(Countdown(None, 0)).solution
        except ContradictionError:
            return None
        found = harm.examine(solution.positions)
        if not found.objections:
            enough = solution.converged and harm.gain(found).mean > wanted
            return (again, found) if enough else None
    return None


def _with_neighbours(mesh: Mesh, vertices: Bools) -> Bools:
    touched = mesh.edges[vertices[mesh.edges].any(axis=1)]
    grown = vertices.copy()
    grown[touched] = True
    return grown


def _mends(now: Examined, found: Examined) -> bool:
    """Tell whether less is amiss than without guard rounds, and nothing speaks against it."""
    return now.amiss < found.amiss and not now.objections


def _serves(now: Examined, found: Examined, largest: float = _LARGEST_COST) -> bool:
    """Tell whether the distance allows it, which counts for less where an answer harms."""
    return bool(found.objections) or _is_near(now, found, largest)


def _is_near(mended: Examined, found: Examined, largest: float) -> bool:
    """Tell whether what guard rounds have mended costs next to nothing in distance."""
    now, was = mended.distances, found.distances
    near = now.mean <= _MENDING_COST * was.mean and now.p95 <= _MENDING_COST * was.p95
    return near and mended.farthest_vertex <= largest * found.farthest_vertex
