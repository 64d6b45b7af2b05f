"""Which points of a moving mesh stay on one side of a closed reference, and of what plane."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from meshcone.errors import InputError
from meshcone.options import ConeOptions
from meshcone.program.cones import OneSide, StayingEdges, StayingFaces, StayingVertices
from meshcone.quality.directions import inside
from meshcone.quality.edge_uses import EdgeUses
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot

# How far from a face it is asked what is outside, as a share of the face's own size.
_PROBE = 1e-3
# Of a row without a normal: its slack is the radius, whatever the positions.
_NEVER = -1.0


@dataclass(frozen=True)
class Staying:
    """One side of a closed reference.

    Attributes:
        tree: of the reference.
        signs: (m,) 1 for faces of the reference whose normal points to the side, −1 for those
            whose normal points away, 0 for those that have the same on either side.
        offset: how far to stay away at least, in the frame.
    """

    tree: SurfaceTree
    signs: Floats
    offset: float

    @staticmethod
    def of(tree: SurfaceTree, asked: ConeOptions, radius: float) -> Staying | None:
        """Resolve what was asked for; None where it is nothing.

        Args:
            tree: of the reference, in the frame.
            asked: the request.
            radius: the frame's radius in model units.

        Raises:
            InputError: the reference has no inside.
        """
        if asked.stay is None:
            return None
        _require_closed(tree.mesh, asked.stay)
        turned = 1.0 if asked.stay == "outside" else -1.0
        offset = 0.0 if asked.offset is None else asked.offset.in_frame(radius)
        return Staying(tree, turned * _outward(tree.mesh), offset)

    def families(self, moving: Mesh, fixed: Bools | None) -> list[OneSide]:
        """Hold vertices, middles of edges and centres of faces to planes at their closest points.

        A point between vertices that faces away from its closest point belongs to another part of
        the reference and is left out, as is one that no vertex could move.

        Args:
            moving: the mesh where a round starts.
            fixed: (n,) vertices that stay whatever is asked, or None for none.
        """
        return list(self._families(moving, fixed))

    def _families(self, moving: Mesh, fixed: Bools | None) -> Iterator[OneSide]:
        kinds = (
            (StayingVertices, moving.used_vertices[:, None]),
            (StayingEdges, moving.edges),
            (StayingFaces, moving.faces),
        )
        agreeing = 0.0
        for kind, touched in kinds:
            vertices = touched if fixed is None else touched[~fixed[touched].all(axis=1)]
            points = moving.vertices[vertices].mean(axis=1)
            closest = self.tree.closest(points)
            normals = self.tree.mesh.face_normals[closest.faces]
            facing = row_dot(moving.vertex_normals[vertices].sum(axis=1), normals)
            if kind is StayingVertices:  # the mesh may face the other way as a whole
                agreeing = 1.0 if facing.sum() >= 0 else -1.0
            signs = self.signs[closest.faces]
            if kind is not StayingVertices:
                signs = np.where(agreeing * facing > 0, signs, 0.0)
            # Multipliers carry over to the next round by index: what is not asked keeps its place.
            offsets = np.where(signs == 0, _NEVER, self.offset)
            yield kind(vertices, closest.points, signs[:, None] * normals, offsets)


def _require_closed(reference: Mesh, side: str) -> None:
    if reference.is_points:
        raise InputError(
            f"option 'cones.stay': to stay {side} takes a closed reference, and this one has "
            "points and no faces; leave the option out"
        )
    uses = EdgeUses.of(reference)
    open_edges = int(np.count_nonzero(uses.counts != 2))
    if open_edges or uses.opposed:
        found = (
            f"{open_edges:,} edges that do not have two faces"
            if open_edges
            else f"{uses.opposed:,} edges between faces turned in opposite directions"
        )
        raise InputError(
            f"option 'cones.stay': to stay {side} takes a closed reference, and this one has "
            f"{found}; repair it, or leave the option out"
        )


def _outward(reference: Mesh) -> Floats:
    """Say of each face whether its normal points out of the reference, (m,): 1, −1, or 0.

    Within a piece all faces agree; of each, what lies on either side of its largest face is asked.
    A piece within another encloses nothing that is not enclosed already, and says 0.
    """
    count, edges = len(reference.vertices), reference.edges
    graph = sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count))
    _, labels = connected_components(graph, directed=False)
    _, piece = np.unique(labels[reference.faces[:, 0]], return_inverse=True)
    largest = _largest_of_each(piece, reference.face_areas)
    centres = reference.corners[largest].mean(axis=1)
    step = _PROBE * np.sqrt(reference.face_areas[largest])[:, None]
    step = step * reference.face_normals[largest]
    behind, ahead = (inside(centres + side * step, reference) for side in (-1, 1))
    return (behind.astype(np.float64) - ahead)[piece]


def _largest_of_each(group: Ints, values: Floats) -> Ints:
    """The member with the largest value of each group 0, 1, …, for (m,) groups and values."""
    order = np.lexsort((values, group))
    last = np.append(np.flatnonzero(np.diff(group[order])), len(group) - 1)
    return np.asarray(order[last])
