"""Cracks: places where two open borders run along each other without being joined."""

from __future__ import annotations

import numpy as np

from meshcone.quality.box_pairs import TooManyPairsError, overlapping_pairs
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, Ints, row_dot, row_lengths
from meshcone.surface.box_tree import BoxTree

# Relative to the reference's radius.
_WIDEST = 1e-4


def count_cracks(mesh: Mesh, most_pairs: int) -> int | None:
    """Count the edges of open borders that run within 1e-4 of the radius of another border.

    An edge counts if its middle is that near to an edge with which it shares no vertex. The
    borders need not have their vertices in the same places.

    Args:
        mesh: in the reference's frame, where its radius is 1.
        most_pairs: pairs of border edges that may be compared.

    Returns:
        The count; None where there are more pairs than that.
    """
    sides = mesh.border_sides
    ends = np.stack([mesh.faces[sides], np.roll(mesh.faces, -1, axis=1)[sides]], axis=1)
    corners = mesh.vertices[ends]
    cracked = np.zeros(len(ends), dtype=bool)
    tree = BoxTree.of(mesh.vertices, ends[:, [0, 1, 1]])
    try:
        for first, second in overlapping_pairs(tree, most_pairs, within=_WIDEST):
            apart = ~(ends[first][:, :, None] == ends[second][:, None, :]).any(axis=(1, 2))
            for one, other in ((first[apart], second[apart]), (second[apart], first[apart])):
                cracked[one[_distances(corners, one, other) <= _WIDEST]] = True
    except TooManyPairsError:
        return None
    return int(np.count_nonzero(cracked))


def _distances(corners: Floats, edges: Ints, others: Ints) -> Floats:
    """Return the distance of the middles of edges from other edges, (k,)."""
    middles = corners[edges].mean(axis=1)
    start, along = corners[others, 0], corners[others, 1] - corners[others, 0]
    length = np.maximum(row_dot(along, along), 1e-300)
    share = np.clip(row_dot(middles - start, along) / length, 0, 1)
    return row_lengths(middles - start - share[:, None] * along)
