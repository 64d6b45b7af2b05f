"""Vertices that follow the edge they lie on, where two borders divide one seam otherwise.

A vertex within an edge of the other side moves by what that place of the edge moves. The ends of
the edge may lie within edges of the first side and follow those. In the end every vertex that
follows moves by a mean of the moves of some that are free, which is what is solved for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.sparse.linalg import splu

from meshcone.program.cones import EdgeTies
from meshcone.quality.contacts import Contacts
from meshcone.surface.arrays import Bools, Floats, Ints

# Weights below this are the rounding of a factorisation.
_ROUNDING = 1e-13
_COLUMNS_AT_ONCE = 64


@dataclass(frozen=True)
class Ties:
    """Which vertices of a mesh follow others.

    Attributes:
        rest: (n, 3) the mesh.
        cones: that each lies on its edge, as constraints.
        weights: (n, n) moves of all vertices from those of the free ones; rows add up to 1.
    """

    rest: Floats
    cones: EdgeTies
    weights: sparse.csr_array

    @staticmethod
    def of(positions: Floats, contacts: Contacts) -> Ties | None:
        """Let each vertex within an edge follow the nearest one; None where there is none."""
        order = np.flatnonzero(contacts.inside)
        order = order[np.argsort(contacts.gaps[order], kind="stable")]
        vertices, first = np.unique(contacts.vertices[order], return_index=True)
        edges, shares = contacts.edges[order[first]], contacts.shares[order[first]]
        anchored = ~_going_round(vertices, edges, len(positions))
        vertices, edges, shares = vertices[anchored], edges[anchored], shares[anchored]
        if not len(vertices):
            return None
        weights = _weights(vertices, edges, shares, len(positions))
        cones = EdgeTies.at(positions, vertices, *_straight(weights[vertices], edges, shares))
        return Ties(positions, cones, weights)

    @cached_property
    def tied(self) -> Bools:
        """(n,) which vertices follow others."""
        found = np.zeros(len(self.rest), dtype=bool)
        found[self.cones.vertices[:, 0]] = True
        return found

    @cached_property
    def offsets(self) -> Floats:
        """(n, 3) what weights times positions lack of where a vertex that follows is."""
        return np.where(self.tied[:, None], self.rest - self.weights @ self.rest, 0.0)

    def settled(self, positions: Floats) -> Floats:
        """Return (n, 3) positions with what follows exactly where it belongs."""
        moved = self.rest + self.weights @ (positions - self.rest)
        return np.where(self.tied[:, None], moved, positions)

    def closed(self, held: Bools) -> Bools:
        """Add to (n,) held vertices those that they follow, and what follows only held ones."""
        followed = self.weights[np.flatnonzero(held & self.tied)].indices
        held = held.copy()
        held[followed] = True
        loose = self._follows @ (~held).astype(np.int64)  # free ones that each follows
        return np.asarray(held | (self.tied & (loose == 0)))

    @cached_property
    def _follows(self) -> sparse.csr_array:
        weights = self.weights
        ones = np.ones(weights.nnz, dtype=np.int64)
        return sparse.csr_array((ones, weights.indices, weights.indptr), shape=weights.shape)


def _going_round(vertices: Ints, edges: Ints, count: int) -> Bools:
    """Find vertices to leave free, so that all others follow a free one in the end, (k,).

    Around a seam that is closed each may follow the next, and none is free.
    """
    left_free = np.zeros(len(vertices), dtype=bool)
    while True:
        leads = np.stack([edges.ravel(), np.repeat(vertices, 2)])[:, np.repeat(~left_free, 2)]
        tied = np.zeros(count, dtype=bool)
        tied[vertices[~left_free]] = True
        roots = np.flatnonzero(~tied)
        links = np.concatenate([leads, [np.full(len(roots), count), roots]], axis=1)
        graph = sparse.csr_array((np.ones(links.shape[1]), links), shape=(count + 1, count + 1))
        adrift = np.ones(count + 1, dtype=bool)
        adrift[breadth_first_order(graph, count, return_predecessors=False)] = False
        if not adrift[vertices].any():
            return left_free
        among = graph[np.flatnonzero(adrift)][:, np.flatnonzero(adrift)]
        _, part = connected_components(among, directed=False)
        _, first = np.unique(part, return_index=True)
        left_free |= np.isin(vertices, np.flatnonzero(adrift)[first])


def _weights(vertices: Ints, edges: Ints, shares: Floats, count: int) -> sparse.csr_array:
    """Write each vertex's move as a mean of moves of free ones, (n, n)."""
    numbers = np.repeat(np.arange(len(vertices)), 2)
    entries = np.stack([1 - shares, shares], axis=1).ravel()
    direct = sparse.csr_array((entries, (numbers, edges.ravel())), shape=(len(vertices), count))
    free = np.ones(count)
    free[vertices] = 0
    followed = _through_others(
        sparse.csr_array(direct @ sparse.diags_array(free)), sparse.csr_array(direct[:, vertices])
    )
    weights = sparse.diags_array(free) + _placed(vertices, count) @ followed
    result = sparse.csr_array(weights)
    result.eliminate_zeros()
    return result


def _straight(weights: sparse.csr_array, edges: Ints, shares: Floats) -> tuple[Ints, Floats]:
    """Tie what moves by a mean of two free vertices to these two, whatever lies between.

    It says the same, and a chain of ties along a seam would take the solvers many steps to follow.

    Args:
        weights: (k, n) of the vertices that follow.
        edges: (k, 2) what each lies on.
        shares: (k,) where.
    """
    two = np.diff(weights.indptr) == 2
    first = weights.indptr[:-1][two]
    edges, shares = edges.copy(), shares.copy()
    edges[two] = weights.indices[first[:, None] + np.arange(2)]
    shares[two] = weights.data[first + 1]
    return edges, shares


def _through_others(free: sparse.csr_array, others: sparse.csr_array) -> sparse.csr_array:
    """Replace what (k, n) rows take of each other, (k, k), by what that takes of the free."""
    others.eliminate_zeros()
    chained = np.union1d(np.flatnonzero(np.diff(others.indptr)), others.indices)
    if not len(chained):
        return free
    among = sparse.eye_array(len(chained)) - others[chained][:, chained]
    factors = splu(sparse.csc_array(among))
    own = sparse.csc_array(free[chained])
    columns = np.flatnonzero(np.diff(own.indptr))
    solved: list[sparse.csc_array] = []
    for first in range(0, len(columns), _COLUMNS_AT_ONCE):
        block = factors.solve(own[:, columns[first : first + _COLUMNS_AT_ONCE]].toarray())
        solved.append(sparse.csc_array(np.where(np.abs(block) > _ROUNDING, block, 0.0)))
    found = sparse.hstack(solved) @ _placed(columns, free.shape[1]).T
    alone = np.ones(free.shape[0])
    alone[chained] = 0
    whole = sparse.diags_array(alone) @ free + _placed(chained, free.shape[0]) @ found
    return sparse.csr_array(whole)


def _placed(rows: Ints, count: int) -> sparse.csr_array:
    """Return the matrix (count, k) that puts k rows in their places among so many."""
    columns = np.arange(len(rows))
    return sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, len(rows)))
