"""Overlapping regions of a mesh, whose programs are solved apart.

The vertices are halved at the median along the longest axis of their box, again and again, as a
k-d tree is built. Each part owns its vertices and solves for those around it as well: what a
vertex does to another fades within a few rings of edges, so that at its own vertices a region is
nearly right although it knows nothing of what lies farther away.

Source: Dryja and Widlund, "An additive variant of the Schwarz alternating method" (1987); Cai and
Sarkis, "A restricted additive Schwarz preconditioner" (1999), for each part keeping its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from meshcone.options import Options
from meshcone.surface.arrays import Floats, Ints

OVERLAP = 8  # rings of edges
# Vertices of a region, where their number is chosen by the size of the mesh.
_COMFORTABLE = 250_000


@dataclass(frozen=True)
class Region:
    """A part of a mesh.

    Attributes:
        own: (k,) its vertices, ascending; each vertex is some region's own.
        free: (f,) those it solves for, ascending: its own and some rings around them.
    """

    own: Ints
    free: Ints


def region_count(options: Options, vertices: int) -> int:
    """Return into how many regions a mesh of so many vertices is divided; 1 is not at all.

    SCS, where it is asked to solve and not only to confirm, is given the whole program.
    """
    asked = options.surface.regions
    if options.solver.method == "full":
        return 1
    if asked == "auto":
        return max(1, -(-vertices // _COMFORTABLE))
    return min(asked, max(vertices, 1))


def divide(
    vertices: Floats, coupling: sparse.csr_array, count: int, rings: int = OVERLAP
) -> tuple[Region, ...]:
    """Divide a mesh into regions of equal size, to one vertex.

    Args:
        vertices: (n, 3) positions.
        coupling: (n, n) with an entry for each edge, in both directions.
        count: of regions, from 1 to n.
        rings: of edges by which a region reaches beyond its own vertices.
    """
    parts = _halved(vertices, np.arange(len(vertices)), count)
    return tuple(Region(own, _grown(own, coupling, rings)) for own in parts)


def neighbours(vertices: Ints, coupling: sparse.csr_array) -> Ints:
    """Return the vertices (j,) and all that are coupled with one of them, ascending."""
    found = np.zeros(coupling.shape[0], dtype=bool)
    found[vertices] = True
    found[coupling[vertices].indices] = True
    return np.flatnonzero(found)


def _halved(vertices: Floats, members: Ints, count: int) -> Iterator[Ints]:
    if count == 1:
        yield np.sort(members)
        return
    points = vertices[members]
    axis = int(np.argmax(np.ptp(points, axis=0)))
    # Members ascend within equal coordinates: the same mesh is divided in one way.
    order = members[np.argsort(points[:, axis], kind="stable")]
    first = count // 2
    cut = len(members) * first // count
    yield from _halved(vertices, np.sort(order[:cut]), first)
    yield from _halved(vertices, np.sort(order[cut:]), count - first)


def _grown(own: Ints, coupling: sparse.csr_array, rings: int) -> Ints:
    reached = np.zeros(coupling.shape[0], dtype=bool)
    reached[own] = True
    front = own
    for _ in range(rings):
        around = coupling[front].indices
        front = np.unique(around[~reached[around]]).astype(np.int64)
        reached[front] = True
    return np.flatnonzero(reached)
