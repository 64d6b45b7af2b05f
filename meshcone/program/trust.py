"""Which vertices have nothing on the reference to follow.

The closest point of a vertex says nothing of where it belongs if the reference has a hole
there, or lacks the part. Such a vertex has no pull; its neighbours carry it.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from meshcone.program.prepared_reference import PreparedReference
from meshcone.surface import ClosestPoints, Mesh, SurfaceTree
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot, row_lengths
from meshcone.surface.closest import barycentric_weights

# Distances are relative to the reference's radius. A part is far from the reference if it is
# farther than a few median distances, and this far at least.
_FAR_IN_MEDIANS, _FAR_FLOOR = 4.0, 0.05
# A separate piece that the rest of the source does without needs to be no farther than this, be it
# a knob close above a plate.
_PIECE_FLOOR = 1e-4
# The reference lacks a part of the source only if the source covers this share of it.
_COVERED = 0.97
# A vertex lies across a border if its closest point is on one and less than this share of
# the way there is along the normal; from this many median distances on it is no noise.
_ALONG_NORMAL = 0.7
_ACROSS_IN_MEDIANS = 3.0
_ON_EDGE = 1e-6


def without_counterpart(
    source: Mesh,
    adjacency: sparse.csr_array,
    pieces: Ints,
    distances: Floats,
    reference: PreparedReference,
) -> Bools:
    """Find the vertices of parts that the reference lacks, (n,).

    A part is a connected set of vertices that are far away while the rest covers the reference.
    One vertex alone is a spike, which belongs to the surface around it: a part has a vertex
    whose neighbours are far as well. A piece that is far by half is a part as a whole, and need not
    be as far.

    Args:
        source: the input in the frame.
        adjacency: (n, n) its edges.
        pieces: (n,) number of the connected piece that each vertex belongs to.
        distances: (n,) of its vertices from the reference.
        reference: the reference.
    """
    used = source.used_vertices
    median = float(np.median(distances[used]))
    limit = _limit(median)
    parts = _parts(distances > limit, adjacency)
    lost = _unless_needed(source, reference, parts | _by_half(parts, pieces), limit)
    if len(np.unique(pieces[used])) > 1:
        # Where a piece has most of the vertices, its own distance is the median of theirs.
        back = SurfaceTree(source).closest(reference.points).distances
        limit = _limit(min(median, float(np.median(back))))
        whole = _by_half(_parts(distances > limit, adjacency), pieces)
        lost |= _unless_needed(source, reference, whole, limit)
        median = float(np.median(back))
        if np.mean(back <= _limit(median)) >= _COVERED:  # else one may belong where there is none
            limit = max(_FAR_IN_MEDIANS * median, _PIECE_FLOOR)
            lost |= _needless_pieces(source, pieces, distances, reference, limit)
    return lost


def _parts(far: Bools, adjacency: sparse.csr_array) -> Bools:
    """Find the connected sets of far vertices in which one has far neighbours alone, (n,)."""
    degree = np.diff(adjacency.indptr)
    inside = far & (degree > 0) & (adjacency @ far.astype(np.float64) >= degree)
    kept = sparse.diags_array(far.astype(np.float64))
    _, labels = connected_components(kept @ adjacency @ kept, directed=False)
    return np.asarray(far & np.isin(labels, labels[inside]))


def _limit(median: float) -> float:
    return max(_FAR_IN_MEDIANS * median, _FAR_FLOOR)


def _by_half(far: Bools, pieces: Ints) -> Bools:
    """Find the vertices of pieces of which more than half are far, (n,)."""
    return np.asarray((np.bincount(pieces, far) > 0.5 * np.bincount(pieces))[pieces])


def _unless_needed(source: Mesh, reference: PreparedReference, lost: Bools, limit: float) -> Bools:
    """Return (n,) the vertices if the rest of the source covers the reference, else none."""
    none = np.zeros(len(lost), dtype=bool)
    rest = source.faces[~lost[source.faces].any(axis=1)]
    if not len(rest) or not lost.any():
        return none
    uncovered = SurfaceTree(Mesh(source.vertices, rest)).closest(reference.points).distances
    return lost if np.mean(uncovered <= limit) >= _COVERED else none


def _needless_pieces(
    source: Mesh,
    pieces: Ints,
    distances: Floats,
    reference: PreparedReference,
    limit: float,
) -> Bools:
    """Find the vertices of pieces that are far by half while the rest is where they were, (n,).

    A piece stands for something if the rest is farther than the limit from what it is closest to.
    """
    labels = pieces[source.faces[:, 0]]
    count = int(pieces.max()) + 1
    far = distances[source.faces].mean(axis=1) > limit
    areas = np.bincount(labels, source.face_areas, minlength=count)
    candidates = np.bincount(labels, source.face_areas * far, minlength=count) > 0.5 * areas
    rest = source.faces[~candidates[labels]]
    if not candidates.any() or not len(rest):
        return np.zeros(len(pieces), dtype=bool)
    uncovered = SurfaceTree(Mesh(source.vertices, rest)).closest(reference.points).distances > limit
    closest = labels[SurfaceTree(source).closest(reference.points).faces]
    known = np.bincount(closest, minlength=count)
    needed = np.bincount(closest, uncovered, minlength=count) > (1 - _COVERED) * known
    return (candidates & ~needed)[pieces]


def median_where(distances: Floats, chosen: Bools) -> float:
    """Return the median of the chosen distances; of all if none is chosen."""
    return float(np.median(distances[chosen] if chosen.any() else distances))


def across_a_border(
    points: Floats, closest: ClosestPoints, mesh: Mesh, noise: float | None = None
) -> Bools:
    """Find the points over a hole of a mesh, or beyond its border, (k,).

    Args:
        points: (k, 3) positions.
        closest: the mesh's closest points to them.
        mesh: the mesh.
        noise: distance from it that is none of its border; by default a few medians of the points
            that are closest to its inside, as those beyond may be the most.
    """
    if not mesh.border_sides.any():
        return np.zeros(len(points), dtype=bool)
    shares = barycentric_weights(closest.points, mesh, closest.faces)
    # The side from a corner to the next lies opposite of the third.
    on_side = np.roll(shares <= _ON_EDGE, -2, axis=1)
    on_border = (on_side & mesh.border_sides[closest.faces]).any(axis=1)
    # Of the faces around a corner, the one that was found need not have a side on the border.
    at_corner = shares >= 1 - _ON_EDGE
    on_border |= (at_corner & mesh.border_vertices[mesh.faces[closest.faces]]).any(axis=1)
    inside = np.asarray(~on_border)
    offsets = points - closest.points
    along = np.abs(row_dot(offsets, mesh.face_normals[closest.faces]))
    sideways = along < _ALONG_NORMAL * row_lengths(offsets)
    if noise is None:
        noise = _ACROSS_IN_MEDIANS * median_where(closest.distances, inside)
    return np.asarray(on_border & sideways & (closest.distances > noise))
