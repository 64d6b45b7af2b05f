"""Cracks: places where two open borders run along each other without being joined."""

from __future__ import annotations

import numpy as np

from meshcone.quality.box_pairs import TooManyPairsError, overlapping_pairs
from meshcone.quality.contacts import GAP, GAP_OVER_EDGE, nearest_on_edges, reaches
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, row_lengths
from meshcone.surface.box_tree import BoxTree


def count_cracks(mesh: Mesh, most_pairs: int) -> int | None:
    """Count the edges of open borders that run within 1e-4 of the radius of another border.

    It may be farther away where the file may have rounded the two that far apart, and no farther
    than a twentieth of either edge.

    An edge counts if its middle is that near to an edge with which it shares no vertex, or which
    leaves a shared one in the same direction. The borders need not have their vertices in the same
    places.

    Args:
        mesh: in the reference's frame, where its radius is 1.
        most_pairs: pairs of border edges that may be compared.

    Returns:
        The count; None where there are more pairs than that.
    """
    sides = mesh.border_sides
    ends = np.stack([mesh.faces[sides], np.roll(mesh.faces, -1, axis=1)[sides]], axis=1)
    faces, corners = np.nonzero(sides)[0], mesh.vertices[ends]
    lengths = row_lengths(corners[:, 1] - corners[:, 0])
    reach = np.maximum(GAP, np.minimum(reaches(mesh)[ends].max(axis=1), GAP_OVER_EDGE * lengths))
    farthest = float(reach.max(initial=GAP))
    cracked = np.zeros(len(ends), dtype=bool)
    tree = BoxTree.of(mesh.vertices, ends[:, [0, 1, 1]])
    try:
        for pair in overlapping_pairs(tree, most_pairs, within=farthest):
            apart = _of_two_borders(mesh, ends, faces, reach, *pair)
            first, second = (edges[apart] for edges in pair)
            for one, other in ((first, second), (second, first)):
                middles = corners[one].mean(axis=1)
                _, away = nearest_on_edges(middles, corners[other])
                cracked[one[away <= np.minimum(reach[one], reach[other])]] = True
    except TooManyPairsError:
        return None
    return int(np.count_nonzero(cracked))


def _of_two_borders(
    mesh: Mesh, ends: Ints, faces: Ints, reach: Floats, first: Ints, second: Ints
) -> Bools:
    """Tell which pairs of border edges do not simply follow each other on one border, (k,).

    Edges that share a vertex follow each other there, unless the shorter one lies along the
    other: then the two sides of a seam meet in that vertex.
    """
    apart: Bools = ~(ends[first][:, :, None] == ends[second][:, None, :]).any(axis=(1, 2))
    meeting = np.flatnonzero(~apart & (faces[first] != faces[second]))
    pairs = np.stack([first[meeting], second[meeting]])
    along = mesh.vertices[ends[pairs]]
    lengths = np.linalg.norm(along[..., 1, :] - along[..., 0, :], axis=-1)
    short, long = np.take_along_axis(pairs, lengths.argsort(axis=0), axis=0)
    starts_there = (ends[short, :1] == ends[long]).any(axis=1)
    far = np.where(starts_there, ends[short, 1], ends[short, 0])
    _, away = nearest_on_edges(mesh.vertices[far], mesh.vertices[ends[long]])
    apart[meeting] = away <= np.minimum(
        reach[pairs].min(axis=0), GAP_OVER_EDGE * lengths.min(axis=0)
    )
    return apart
