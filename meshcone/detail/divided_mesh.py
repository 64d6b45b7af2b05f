"""A mesh that is divided step by step, and remembers where each of its faces came from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.surface import Mesh, Subdivision
from meshcone.surface.arrays import Bools, Floats, Ints, differences, row_dot

# Corners 0 to 2 of a face and the middles 3 to 5 of its sides, side k from corner k to the next,
# turned so that the sides that are split are the first ones, and of three the longest is the
# second. The quadrilateral that is left has two diagonals.
_HALVES = np.array([[0, 3, 2], [3, 1, 2]])
_TWO = np.array([[[3, 1, 4], [0, 3, 4], [0, 4, 2]], [[3, 1, 4], [0, 3, 2], [3, 4, 2]]])
_TWO_DIAGONALS = ((0, 4), (3, 2))
_THREE = np.array(
    [
        [[3, 1, 4], [4, 2, 5], [0, 3, 4], [0, 4, 5]],
        [[3, 1, 4], [4, 2, 5], [0, 3, 5], [3, 4, 5]],
    ]
)
_THREE_DIAGONALS = ((0, 4), (3, 5))


@dataclass(frozen=True)
class DividedMesh:
    """A mesh some faces of which are parts of faces of the mesh it began as.

    Attributes:
        mesh: as it is now, wherever its vertices have been moved.
        parents: (f,) the face each face lies in.
        corners: (f, 3, 3) barycentric numerators of its corners in that face.
        exponent: the numerators are over 2 ** exponent.
        sources: number of faces it began with.
    """

    mesh: Mesh
    parents: Ints
    corners: Ints
    exponent: int
    sources: int

    @staticmethod
    def of(mesh: Mesh) -> DividedMesh:
        """Begin with no face divided."""
        count = len(mesh.faces)
        corners = np.tile(np.eye(3, dtype=np.int64), (count, 1, 1))
        return DividedMesh(mesh, np.arange(count, dtype=np.int64), corners, 0, count)

    def moved_to(self, vertices: Floats) -> DividedMesh:
        """Return the same division with its vertices at other positions (n, 3)."""
        mesh = self.mesh.moved_to(vertices)
        return DividedMesh(mesh, self.parents, self.corners, self.exponent, self.sources)

    def split(self, marked: Bools) -> DividedMesh:
        """Split edges in the middle, and the faces beside them so that they still fit together.

        Args:
            marked: (e,) which of ``mesh.edges`` to split.
        """
        mesh, sides = self.mesh, edge_of_sides(self.mesh)
        ends = mesh.edges[marked]
        middles = (mesh.vertices[ends[:, 0]] + mesh.vertices[ends[:, 1]]) / 2
        vertices = np.concatenate([mesh.vertices, middles])
        numbers = np.full(len(mesh.edges), -1, dtype=np.int64)
        numbers[marked] = len(mesh.vertices) + np.arange(len(ends))
        table = np.concatenate([mesh.faces, numbers[sides]], axis=1)
        rows, local = _children(vertices, table, marked[sides])
        places = 2 * self.corners
        middle_places = self.corners + np.roll(self.corners, -1, axis=1)
        places = np.concatenate([places, middle_places], axis=1)
        return DividedMesh(
            Mesh(vertices, np.take_along_axis(table[rows], local, axis=1)),
            self.parents[rows],
            places[rows[:, None], local],
            self.exponent + 1,
            self.sources,
        )

    def subdivision(self) -> Subdivision:
        """How the faces it began with are divided."""
        corners, exponent = self.corners, self.exponent
        while exponent and not (corners % 2).any():
            corners, exponent = corners // 2, exponent - 1
        order = np.argsort(self.parents, kind="stable")
        return Subdivision(
            self.sources, self.parents[order], corners[order].astype(np.int32), exponent
        )


def edge_of_sides(mesh: Mesh) -> Ints:
    """Row of ``mesh.edges`` of each side (f, 3) of each face; side k runs from corner k."""
    following = np.roll(mesh.faces, -1, axis=1)
    low, high = np.minimum(mesh.faces, following), np.maximum(mesh.faces, following)
    count = len(mesh.vertices)
    keys = mesh.edges[:, 0] * count + mesh.edges[:, 1]
    return np.asarray(np.searchsorted(keys, low * count + high), dtype=np.int64)


def _children(vertices: Floats, table: Ints, marked: Bools) -> tuple[Ints, Ints]:
    """Divide faces by templates.

    Args:
        vertices: (n, 3) positions, the middles' among them.
        table: (f, 6) each face's corners and middles, −1 for one that is not split.
        marked: (f, 3) which sides are split.

    Returns:
        (c,) the face of each child, ascending, and (c, 3) its corners as columns of the table.
    """
    split = marked.sum(axis=1)
    rows = [np.flatnonzero(split == 0)]
    local = [np.tile(np.arange(3), (len(rows[0]), 1))]
    one = np.flatnonzero(split == 1)
    _add(rows, local, one, marked[one].argmax(axis=1), np.tile(_HALVES, (len(one), 1, 1)))
    two = np.flatnonzero(split == 2)
    turn = ((~marked[two]).argmax(axis=1) + 1) % 3
    shapes = _shorter(vertices, table[two], turn, _TWO, _TWO_DIAGONALS)
    _add(rows, local, two, turn, shapes)
    three = np.flatnonzero(split == 3)
    corners = vertices[table[three, :3]]
    lengths = np.einsum("ijk,ijk->ij", *[np.roll(corners, -1, axis=1) - corners] * 2)
    turn = (lengths.argmax(axis=1) + 2) % 3
    shapes = _shorter(vertices, table[three], turn, _THREE, _THREE_DIAGONALS)
    _add(rows, local, three, turn, shapes)
    owners = np.concatenate(rows)
    order = np.argsort(owners, kind="stable")
    return owners[order], np.concatenate(local)[order]


def _add(rows: list[Ints], local: list[Ints], faces: Ints, turn: Ints, shapes: Ints) -> None:
    """Append the (k, c, 3) children of faces, turned back by (k,) corners."""
    rows.append(np.repeat(faces, shapes.shape[1]))
    local.append(_turned(shapes, turn[:, None, None]).reshape(-1, 3))


def _turned(columns: Ints, turn: Ints) -> Ints:
    """Columns of the table in the face as it is, of those in the face as it was turned."""
    return np.asarray(columns // 3 * 3 + (columns % 3 + turn) % 3)


def _shorter(
    vertices: Floats,
    table: Ints,
    turn: Ints,
    shapes: Ints,
    diagonals: tuple[tuple[int, int], tuple[int, int]],
) -> Ints:
    """Choose for each face the shape (k, c, 3) with the shorter diagonal, of two."""
    lengths = []
    for ends in diagonals:
        columns = _turned(np.tile(np.array(ends), (len(table), 1)), turn[:, None])
        along = differences(vertices, np.take_along_axis(table, columns, axis=1))
        lengths.append(row_dot(along, along))
    return np.asarray(shapes[(lengths[1] < lengths[0]).astype(np.int64)])
