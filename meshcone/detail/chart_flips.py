"""Swaps diagonals on sides of the source's faces, within charts of texture coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.detail.divided_mesh import DividedMesh
from meshcone.detail.flips import PASSES, Pairs
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Bools, Floats, Ints, normalized, row_dot
from meshcone.surface.charts import ChartedFaces, Charts

# Of texture coordinates, or of the largest where they go beyond 1: a file may move each by half
# of this, and triangles must not turn over by it.
_STORED = 4e-7
_FOLDED = 0.2  # least cosine, where the source is, between a new face and the two it replaces


@dataclass(frozen=True)
class Swapped:
    """A divided mesh with diagonals swapped.

    Attributes:
        mesh: as it is now.
        slots: (f, 3) which corners of its children each face has; see :class:`Subdivision`.
    """

    mesh: Mesh
    slots: Ints


def flip_in_charts(divided: DividedMesh, charts: Charts, rest: Mesh, tree: SurfaceTree) -> Swapped:
    """Swap diagonals wherever a chart of texture coordinates lets them.

    Both triangles run around in the plane of the texture coordinates as the two that they
    replace, so that the chart covers what it covered. Neither folds the surface, where it was
    moved to or where the source has it, nor is a sliver.

    Args:
        divided: the mesh, where it was moved to.
        charts: of the source's faces.
        rest: the source, as it was sent.
        tree: closest points on the reference.
    """
    subdivision = divided.subdivision()
    faces = charts.over(subdivision)
    weights = subdivision.corners / 2.0**subdivision.exponent
    still = np.einsum("fcp,fpk->fck", weights, rest.corners[subdivision.parents])
    now = Swapped(divided.mesh, subdivision.slots)
    for _ in range(PASSES):
        pairs = _allowed(Pairs.of(now.mesh), now.slots, faces, still)
        chosen = pairs.independent(pairs.gain(now.mesh, tree), len(now.slots))
        if not len(chosen):
            break
        some = pairs.only(chosen)
        mesh = Mesh(now.mesh.vertices, some.swapped(now.mesh.faces))
        now = Swapped(mesh, some.swapped(now.slots))
    return now


def _allowed(pairs: Pairs, slots: Ints, faces: ChartedFaces, still: Floats) -> Pairs:
    """The pairs whose diagonals may be swapped, whether or not anything is gained."""
    first, second = pairs.faces.T
    groups = faces.groups
    pairs = pairs.only((groups[first] >= 0) & (groups[first] == groups[second]))
    first, second = pairs.faces.T
    other = pairs.turns[:, 1]
    a, b, _, _ = pairs.around(slots)
    ids = faces.corners.ravel()
    one = ids[a] == ids[slots[second, (other + 1) % 3]]
    pairs = pairs.only(one & (ids[b] == ids[slots[second, other]]))
    for plane, turns in zip(faces.planes, faces.turns.T, strict=True):
        a, b, c, d = (plane.reshape(-1, 2)[each] for each in pairs.around(slots))
        sense = turns[pairs.faces[:, 0]]
        runs = _runs(a, d, c, sense) & _runs(d, b, c, sense)
        pairs = pairs.only(runs | (sense == 0))
    a, b, c, d = (still.reshape(-1, 3)[each] for each in pairs.around(slots))
    facing = normalized(np.cross(b - a, c - a) + np.cross(a - b, d - b))
    after = np.cross(d - a, c - a), np.cross(b - d, c - d)
    flat = np.min([row_dot(normalized(each), facing) for each in after], axis=0)
    return pairs.only(flat > _FOLDED)


def _runs(p: Floats, q: Floats, r: Floats, sense: Ints) -> Bools:
    """Whether triangles run around in a sense, wherever a file may put their corners."""
    one, other = q - p, r - p
    areas = sense * (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    sizes = np.maximum(np.abs(one), np.abs(other)).max(axis=1, initial=0.0)
    largest = np.maximum(1.0, np.abs(np.stack([p, q, r])).max(axis=(0, 2), initial=0.0))
    return np.asarray(areas > 4 * _STORED * largest * sizes)
