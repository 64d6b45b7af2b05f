"""Faces without a normal, and which faces meet across them.

Writers of CAD models close the gap between an edge and two halves of it with a triangle whose
corners lie on one line. Such a face has no area and so no normal: nothing bends at its sides.
The surface bends between the faces with an area that lie on either side of the line, and each
part of the line is the edge of two of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot, row_lengths

# Height over the longest side: the normal of what is thinner is one of rounding to 32 bits.
_THIN = 1e-6
# Such heights over the largest coordinate are rounding to 64 bits.
_ROUNDING = 16 * 2.0**-53
# A side that is shorter, relative to the longest of its face, says nothing of the line.
_SHORT = 1e-4


@dataclass(frozen=True)
class Meetings:
    """Where two faces with a normal meet that agree on what is outside.

    Attributes:
        first, second: (k,) the two faces.
        start, end: (k, 3) of where they meet, in the direction in which the first runs.
        edges: (k,) the edge each is the whole or a part of, from 0.
    """

    first: Ints
    second: Ints
    start: Floats
    end: Floats
    edges: Ints


@dataclass(frozen=True)
class ThinFaces:
    """The faces of a mesh that have no normal, gathered by the line they lie on.

    Attributes:
        mesh: the mesh.
        thin: (m,) which faces are.
        lines: (m,) the line of each thin face, from 0; the others' numbers mean nothing.
        sides: (s,) sides of other faces on these lines, ascending by line; numbered as those
            of ``EdgeUses``.
        line_of_side: (s,) the line of each.
    """

    mesh: Mesh
    thin: Bools
    lines: Ints
    sides: Ints
    line_of_side: Ints

    @staticmethod
    def of(mesh: Mesh, ends: Ints, side_edges: Ints) -> ThinFaces:
        """Find them.

        Args:
            mesh: the mesh.
            ends: (3m, 2) vertices of each side of its faces.
            side_edges: (3m,) the edge of each.
        """
        thin, along = _thin(mesh, ends)
        faces, edges = len(mesh.faces), int(side_edges.max(initial=-1)) + 1
        if not thin.any():
            none = np.zeros(0, dtype=np.int64)
            return ThinFaces(mesh, thin, np.zeros(faces, dtype=np.int64), none, none)
        chosen = np.flatnonzero(along)
        pairs = chosen % faces, faces + side_edges[chosen]
        graph = sparse.coo_array((np.ones(len(chosen)), pairs), (faces + edges, faces + edges))
        _, found = connected_components(graph, directed=False)
        lines: Ints = np.asarray(found, dtype=np.int64)
        on_line = np.zeros(edges, dtype=bool)
        on_line[side_edges[chosen]] = True
        sides = np.flatnonzero(np.tile(~thin, 3) & on_line[side_edges])
        line_of_side = lines[faces + side_edges[sides]]
        order = np.argsort(line_of_side, kind="stable")
        return ThinFaces(mesh, thin, lines[:faces], sides[order], line_of_side[order])

    @cached_property
    def side_ends(self) -> tuple[Floats, Floats]:
        """(s, 3) where each of the sides starts, and where it ends."""
        faces = len(self.mesh.faces)
        corner, face = np.divmod(self.sides, faces)
        start = self.mesh.faces[face, corner]
        end = self.mesh.faces[face, (corner + 1) % 3]
        return self.mesh.vertices[start], self.mesh.vertices[end]

    @cached_property
    def line_lengths(self) -> Floats:
        """(s,) the length of the longest side on the line of each."""
        return self._axes(self._line)[2]

    @cached_property
    def _line(self) -> Ints:
        """(s,) the line of each side, without gaps between the numbers."""
        return np.unique(self.line_of_side, return_inverse=True)[1]

    def meetings(self) -> Meetings:
        """Where just two faces meet across thin ones; a line counts as one edge."""
        start, end = self.side_ends
        if not len(self.sides):
            none = np.zeros(0, dtype=np.int64)
            return Meetings(none, none, start, end, none)
        line = self._line
        origin, axis, longest = self._axes(line)
        from_, to = row_dot(start - origin, axis), row_dot(end - origin, axis)
        runs_up = from_ < to
        one, other, low, high = _covered_once_each_way(
            line, np.minimum(from_, to), np.maximum(from_, to), runs_up
        )
        wide = high - low > _THIN * longest[one]
        one, other, low, high = one[wide], other[wide], low[wide], high[wide]
        # On the side itself: the line of a long one and that of its parts differ by rounding.
        share_low, share_high = (
            ((at - from_[one]) / (to - from_)[one])[:, None] for at in (low, high)
        )
        span = (end - start)[one]
        faces = len(self.mesh.faces)
        return Meetings(
            self.sides[one] % faces,
            self.sides[other] % faces,
            start[one] + share_low * span,
            start[one] + share_high * span,
            line[one],
        )

    def _axes(self, line: Ints) -> tuple[Floats, Floats, Floats]:
        """(s, 3) origin and (s, 3) direction of each side's line, and (s,) its longest side."""
        start, end = self.side_ends
        lengths = row_lengths(end - start)
        order = np.lexsort((lengths, line))
        last = order[np.flatnonzero(np.append(np.diff(line[order]) > 0, True))]
        directions = (end - start)[last] / lengths[last][:, None]
        return start[last][line], directions[line], lengths[last][line]


def _thin(mesh: Mesh, ends: Ints) -> tuple[Bools, Bools]:
    """(m,) faces without a normal, and (3m,) their sides that run along their line."""
    lengths = row_lengths(mesh.vertices[ends[:, 1]] - mesh.vertices[ends[:, 0]]).reshape(3, -1)
    longest = lengths.max(axis=0, initial=0)
    size = np.abs(mesh.corners).max(initial=0)
    thin = 2 * mesh.face_areas <= np.maximum(_THIN * longest, _ROUNDING * size) * longest
    return thin, (thin & (lengths > _SHORT * longest)).ravel()


def _covered_once_each_way(
    line: Ints, low: Floats, high: Floats, runs_up: Bools
) -> tuple[Ints, Ints, Floats, Floats]:
    """Intervals of lines that one side covers upwards, one downwards, and no other.

    Returns:
        (k,) the side that runs up, (k,) the one that runs down, and (k,) where it begins and
        ends.
    """
    count = len(line)
    at = np.concatenate([low, high])
    order = np.lexsort((at, np.tile(line, 2)))
    side, change = order % count, np.where(order < count, 1, -1)
    sums = []
    for way in (runs_up, ~runs_up):
        step = np.where(way[side], change, 0)
        # Where just one side is within, the sum of their numbers is its number.
        sums.append((np.cumsum(step), np.cumsum(step * side)))
    (ups, up), (downs, down) = sums
    alone = np.flatnonzero((ups == 1) & (downs == 1))
    return up[alone], down[alone], at[order[alone]], at[order[alone + 1]]
