"""Faces that pass through others where they did not before faces were added."""

from __future__ import annotations

from meshcone.quality.intersections import count_self_intersections
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats

_FEW = 0.001  # new pairs, as a share of the faces


def new_tangles(rest: Mesh, positions: Floats, most_pairs: int) -> int:
    """Count the pairs of faces that pass through each other, beyond those that did at rest.

    Args:
        rest: the divided source, where it is.
        positions: (n, 3) where its vertices went.
        most_pairs: pairs that may be tested; where there are more, none is counted.
    """
    after = count_self_intersections(rest.moved_to(positions), most_pairs) or 0
    return after - (count_self_intersections(rest, most_pairs) or 0) if after else 0


def are_many(tangles: int, faces: int) -> bool:
    """Whether another way of solving is worth its time for so many of them."""
    return tangles > _FEW * faces
