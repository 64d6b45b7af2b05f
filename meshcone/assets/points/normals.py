"""Normals of points from where their neighbours are.

The normal is the direction in which the nearest neighbours vary least; which of its two ends
is outside is carried from point to point along a minimum spanning tree, as Hoppe et al. (1992,
"Surface reconstruction from unorganized points", sections 3.2 and 3.3) do.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import KDTree

_NEIGHBOURS = 12
_LEAST = 1e-6  # scipy takes a weight of 0 for no edge


def spacing_of(points: NDArray[np.float64]) -> float:
    """Median distance of (n, 3) distinct points from their nearest neighbours."""
    distances = np.asarray(KDTree(points).query(points, k=2)[0])
    return float(np.median(distances[:, 1]))


def estimated_normals(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3) unit normals of (n, 3) distinct points, three at least."""
    count = min(_NEIGHBOURS, len(points))
    near = np.asarray(KDTree(points).query(points, k=count)[1], dtype=np.int64)
    offsets = points[near] - points[near].mean(axis=1, keepdims=True)
    _, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))
    normals = np.asarray(axes)[:, :, 0]
    return np.asarray(normals * _sides(points, normals, near)[:, None])


def _sides(
    points: NDArray[np.float64], normals: NDArray[np.float64], near: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(n,) 1 or -1: which way each normal is to be turned to point outside."""
    rows = np.repeat(np.arange(len(points)), near.shape[1] - 1)
    columns = near[:, 1:].ravel()
    agreement = np.einsum("ij,ij->i", normals[rows], normals[columns])
    weights = 1 - np.abs(agreement) + _LEAST
    graph = sparse.coo_array((weights, (rows, columns)), (len(points), len(points))).tocsr()
    tree = minimum_spanning_tree(graph.maximum(graph.T))
    pieces, labels = connected_components(tree, directed=False)
    sides = np.zeros(len(points))
    # Where a piece reaches highest, up is outside.
    order = np.lexsort((points[:, 2], labels))
    tops = order[np.append(np.flatnonzero(np.diff(labels[order])), len(order) - 1)]
    for top in tops[:pieces].tolist():
        visited, before = breadth_first_order(tree, top, directed=False)
        sides[top] = 1.0 if normals[top, 2] >= 0 else -1.0
        steps = visited[1:]
        turned = np.einsum("ij,ij->i", normals[steps], normals[before[steps]]) < 0
        for step, parent, turn in zip(
            steps.tolist(), before[steps].tolist(), turned.tolist(), strict=True
        ):
            sides[step] = -sides[parent] if turn else sides[parent]
    return sides
