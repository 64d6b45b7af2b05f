"""A triangle mesh as arrays, with what follows from it computed once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from meshcone.surface.arrays import (
    Bools,
    Floats,
    Ints,
    differences,
    normalized,
    row_lengths,
    sorted_distinct,
)

if TYPE_CHECKING:
    import igl

    from meshcone.surface.box_tree import BoxTree


class Connectivity:
    """What follows from the faces alone, and so is common to a mesh and to where it moves.

    Attributes:
        tree: of boxes over the faces, of the first of these meshes that needed one; the others
            refit it.
    """

    def __init__(self, faces: Ints, vertices: int) -> None:
        """Describe faces (m, 3) over so many vertices."""
        self._faces, self._vertices = faces, vertices
        self.tree: BoxTree | None = None

    @cached_property
    def used_vertices(self) -> Ints:
        """Vertices that some face uses, ascending, (u,)."""
        uses = np.bincount(self._faces.ravel(), minlength=self._vertices)
        return np.flatnonzero(uses).astype(np.int64)

    @cached_property
    def edges(self) -> Ints:
        """Undirected edges (e, 2), each once, smaller index first, in lexicographic order."""
        a, b, c = np.ascontiguousarray(self._faces.T)
        from_, to = np.concatenate([a, b, c]), np.concatenate([b, c, a])
        count = max(self._vertices, 1)
        keys = sorted_distinct(np.minimum(from_, to) * count + np.maximum(from_, to))
        edges = np.stack(np.divmod(keys, count), axis=1)
        return np.asarray(edges[edges[:, 0] != edges[:, 1]], dtype=np.int64)

    @cached_property
    def border_sides(self) -> Bools:
        """Whether no other face has a side, (m, 3); side k runs from corner k to the next."""
        next_corners = np.roll(self._faces, -1, axis=1)
        low, high = np.minimum(self._faces, next_corners), np.maximum(self._faces, next_corners)
        keys = (low * max(self._vertices, 1) + high).ravel()
        order = np.argsort(keys, kind="stable")
        first = np.diff(keys[order], prepend=-1) != 0
        last = np.append(first[1:], True) if len(first) else first
        alone = np.empty(len(keys), dtype=bool)
        alone[order] = first & last
        return alone.reshape(-1, 3)

    @cached_property
    def border_vertices(self) -> Bools:
        """Whether a vertex lies on an open border, (n,)."""
        found = np.zeros(self._vertices, dtype=bool)
        found[self._faces[self.border_sides]] = True
        found[np.roll(self._faces, -1, axis=1)[self.border_sides]] = True
        return found


@dataclass(frozen=True)
class Mesh:
    """An indexed triangle mesh.

    Attributes:
        vertices: (n, 3) positions, in whatever unit the caller works in.
        faces: (m, 3) vertex indices, counter-clockwise seen from outside.
        is_points: whether the faces stand for points, each a tiny one of its own: there is no
            surface between them, nor curvature, nor borders.
        precision: (n,) how far apart the numbers are that its file can hold at each vertex, in
            the unit of the vertices; None where they are those of a float64.
    """

    vertices: Floats
    faces: Ints
    is_points: bool = False
    precision: Floats | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", np.ascontiguousarray(self.vertices, dtype=np.float64))
        object.__setattr__(self, "faces", np.ascontiguousarray(self.faces, dtype=np.int64))

    def __getstate__(self) -> dict[str, Any]:
        """What goes to another process; a hierarchy of a library does not, and is built anew."""
        return {name: value for name, value in self.__dict__.items() if name != "windings"}

    def moved_to(self, vertices: Floats, scale: float = 1.0) -> Mesh:
        """Return the mesh with the same faces over other positions.

        Args:
            vertices: (n, 3) the positions.
            scale: how long there is what has length 1 here, where the unit is another.
        """
        precision = None if self.precision is None else scale * self.precision
        moved = Mesh(vertices, self.faces, self.is_points, precision)
        moved.__dict__["_connectivity"] = self._connectivity
        return moved

    def equals(self, other: Mesh) -> bool:
        """Whether another mesh has the same faces over the same positions, to the last bit."""
        return self is other or (
            np.array_equal(self.vertices, other.vertices)
            and np.array_equal(self.faces, other.faces)
        )

    @cached_property
    def _connectivity(self) -> Connectivity:
        return Connectivity(self.faces, len(self.vertices))

    @property
    def used_vertices(self) -> Ints:
        """Vertices that some face uses, ascending, (u,)."""
        return self._connectivity.used_vertices

    @property
    def edges(self) -> Ints:
        """Undirected edges (e, 2), each once, smaller index first, in lexicographic order."""
        return self._connectivity.edges

    @property
    def border_sides(self) -> Bools:
        """Whether no other face has a side, (m, 3); side k runs from corner k to the next."""
        return self._connectivity.border_sides

    @property
    def border_vertices(self) -> Bools:
        """Whether a vertex lies on an open border, (n,)."""
        return self._connectivity.border_vertices

    @cached_property
    def tree(self) -> BoxTree:
        """A tree of boxes over the faces."""
        # Readers of files come by here, and neither search nor need a compiler.
        from meshcone.surface.box_tree import BoxTree

        kin = self._connectivity.tree
        if kin is not None:
            return kin.moved_to(self.vertices)
        self._connectivity.tree = BoxTree.of(self.vertices, self.faces)
        return self._connectivity.tree

    @cached_property
    def windings(self) -> igl.FastWindingNumberBVH:
        """A hierarchy over the faces for winding numbers."""
        import igl  # for the same reason

        hierarchy = igl.FastWindingNumberBVH()
        hierarchy.init(self.vertices, self.faces, 2)
        return hierarchy

    @cached_property
    def crossings(self) -> dict[int, Ints | None]:
        """Pairs of faces that pass through each other, by how many might be tested, once found."""
        return {}

    @cached_property
    def edge_lengths(self) -> Floats:
        """Length of each edge, (e,)."""
        return row_lengths(differences(self.vertices, self.edges))

    @cached_property
    def corners(self) -> Floats:
        """Corner positions of each face, (m, 3, 3)."""
        return self.vertices.take(self.faces, axis=0)

    @cached_property
    def doubled_area_vectors(self) -> Floats:
        """Face normals scaled by twice the face's area, (m, 3)."""
        i, j, k = np.ascontiguousarray(self.faces.T)
        sides = []
        for coordinate in np.ascontiguousarray(self.vertices.T):  # a third of np.cross's time
            first = coordinate.take(i)
            sides.append((coordinate.take(j) - first, coordinate.take(k) - first))
        (ax, bx), (ay, by), (az, bz) = sides
        return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)

    @cached_property
    def face_areas(self) -> Floats:
        """Area of each face, (m,)."""
        return row_lengths(self.doubled_area_vectors) / 2

    @cached_property
    def face_normals(self) -> Floats:
        """Unit normal of each face, (m, 3); zero for a face without area."""
        return normalized(self.doubled_area_vectors)

    @cached_property
    def vertex_normals(self) -> Floats:
        """Unit area-weighted mean of the incident face normals, (n, 3)."""
        count = len(self.vertices)
        summed = np.empty((count, 3))
        flat = self.faces.ravel()
        for axis in range(3):
            weights = np.repeat(self.doubled_area_vectors[:, axis], 3)
            summed[:, axis] = np.bincount(flat, weights, minlength=count)
        return normalized(summed)
