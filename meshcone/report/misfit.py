"""Whether source and reference lie so that refining one towards the other makes sense.

A program of closest points pulls any mesh onto any other. Where the two do not fit, what
comes out is a wreck that lies close to the reference. Such a source is returned as it is,
with words of what aligning it first would do.
"""

from __future__ import annotations

import numpy as np

from meshcone.report.data_checks import placement
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from meshcone.surface.alignment import Alignment, AlignmentMode, align
from meshcone.surface.arrays import Floats, row_dot, row_lengths
from meshcone.surface.similarity import transform_points

_VERTICES = 5000
# Closest points say nothing of where a vertex belongs when it is a radius away from them.
_OUT_OF_REACH = 1.0
# Noise and thin parts turn normals around, but seldom so many.
_OPPOSED = 0.75
# A pair that is nearer than this in the mean starts well, whatever a motion would gain.
_NEAR = 0.1
# A motion explains a distance of which it leaves no more than this share: deformations that
# happen to gain from one leave more.
_EXPLAINED = 0.15
# Near pairs are told of a motion that explains the distance only if it moves vertices by several
# times their distances, as along thin parts, where the closest points say nothing of it; and by
# this share of the radius, as less is small beside what a mesh shows.
_MOVED_IN_DISTANCES, _MOVED_FLOOR = 2.5, 0.02
# Searching takes seconds: only pairs whose centres or second moments differ by this are searched,
# and by no more than this share of it in what no motion changes, as noise has it.
_MOMENTS_APART, _OF_SHAPE = 0.02, 0.5
# A motion can explain the distance of shapes alone whose principal extents agree this well.
_SAME_SHAPE = 0.1
# Extents that differ by less than this factor ask for a motion that keeps the size.
_SAME_SIZE = 1.25


def misfit(source: Mesh, reference: Mesh, seed: int, *, aligned: bool) -> str | None:
    """Say why a source cannot be refined where it lies; None if it can.

    Args:
        source: in the reference's frame.
        reference: in its own frame, where its radius is 1.
        seed: of the search for a motion that explains the distance.
        aligned: whether a motion has been searched for already.
    """
    chosen = source.used_vertices[:: -(-len(source.used_vertices) // _VERTICES)]
    closest = SurfaceTree(reference).closest(source.vertices[chosen])
    agreement = row_dot(source.vertex_normals[chosen], reference.face_normals[closest.faces])
    opposed = float(np.mean(agreement < 0))
    back = SurfaceTree(source).closest(sample_surface(reference, _VERTICES, seed).points)
    distance = float(max(closest.distances.mean(), back.distances.mean()))
    if distance <= _NEAR:
        moved = None if aligned else _moved_along(source, reference, distance, seed)
        if moved is not None or opposed <= _OPPOSED:
            return moved
        return (
            f"{100 * opposed:.0f} % of the source's normals oppose the reference's, which no "
            "motion mends: turn the faces of one of the two around."
        )
    elsewhere = any(placement(source, reference))
    elsewhere |= float(np.mean(closest.distances > _OUT_OF_REACH)) > 0.5
    if not elsewhere and not _alike(source, reference):
        return None
    if aligned:
        return "They lie apart even after aligning." if elsewhere else None
    mode = _mode(source, reference)
    found = align(source, reference, mode, seed)
    falls = _falls(found, mode)
    if found.after <= _EXPLAINED * found.before:
        return falls
    return f"{falls} That is still far: these may be different shapes." if elsewhere else None


def _moved_along(source: Mesh, reference: Mesh, distance: float, seed: int) -> str | None:
    """Say which motion a near pair differs by, where closest points would not find it back."""
    least = max(_MOVED_IN_DISTANCES * distance, _MOVED_FLOOR)
    if not _may_be_moved(source, reference, least) or not _alike(source, reference):
        return None
    mode = _mode(source, reference)
    found = align(source, reference, mode, seed)
    vertices = source.vertices[source.used_vertices]
    moves = row_lengths(transform_points(found.matrix, vertices) - vertices).mean()
    explained = found.after <= _EXPLAINED * found.before
    return _falls(found, mode) if explained and moves >= least else None


def _may_be_moved(source: Mesh, reference: Mesh, least: float) -> bool:
    """Whether vertices that correspond, or the moments, lie as far apart as a motion puts them."""
    if not min(mesh.face_areas.sum() for mesh in (source, reference)):
        return False
    if np.array_equal(source.faces, reference.faces):
        used = source.used_vertices
        apart = row_lengths(source.vertices[used] - reference.vertices[used])
        return float(apart.mean()) >= least
    (centre, spread), (other, others) = (_moments(mesh) for mesh in (source, reference))
    offset = float(max(np.linalg.norm(centre - other), np.linalg.norm(spread - others)))
    of_shape = np.linalg.norm(np.linalg.eigvalsh(spread) - np.linalg.eigvalsh(others))
    return bool(offset >= _MOMENTS_APART and of_shape <= _OF_SHAPE * offset)


def _moments(mesh: Mesh) -> tuple[Floats, Floats]:
    """Return the centre of a surface and the second moments about it, (3,) and (3, 3)."""
    weights = mesh.face_areas / mesh.face_areas.sum()
    centre = weights @ mesh.corners.mean(axis=1)
    arms = mesh.corners - centre
    sums = arms.sum(axis=1)
    squares = np.einsum("mki,mkj->mij", arms, arms) + sums[:, :, None] * sums[:, None, :]
    return centre, np.asarray(np.einsum("m,mij->ij", weights, squares) / 12)


def _falls(found: Alignment, mode: AlignmentMode) -> str:
    return (
        f"With align={mode} the root mean square distance between them would fall from "
        f"{found.before:.3g} to {found.after:.3g} of the reference's radius."
    )


def _alike(source: Mesh, reference: Mesh) -> bool:
    here, there = (_extents(mesh) for mesh in (source, reference))
    apart = here / np.linalg.norm(here) - there / np.linalg.norm(there)
    return bool(np.abs(apart).max() < _SAME_SHAPE)


def _mode(source: Mesh, reference: Mesh) -> AlignmentMode:
    here, there = (np.linalg.norm(_extents(mesh)) for mesh in (source, reference))
    return "rigid" if 1 / _SAME_SIZE < here / there < _SAME_SIZE else "similarity"


def _extents(mesh: Mesh) -> Floats:
    """Return the standard deviations of a surface along its principal axes, ascending, (3,)."""
    points = sample_surface(mesh, _VERTICES, 0).points
    return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(points.T)), 0.0)))
