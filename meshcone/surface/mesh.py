"""A triangle mesh as arrays, with what follows from it computed once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

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


@dataclass(frozen=True)
class Mesh:
    """An indexed triangle mesh.

    Attributes:
        vertices: (n, 3) positions, in whatever unit the caller works in.
        faces: (m, 3) vertex indices, counter-clockwise seen from outside.
    """

    vertices: Floats
    faces: Ints

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", np.ascontiguousarray(self.vertices, dtype=np.float64))
        object.__setattr__(self, "faces", np.ascontiguousarray(self.faces, dtype=np.int64))

    def moved_to(self, vertices: Floats) -> Mesh:
        """Return the mesh with the same faces over other positions (n, 3)."""
        moved = Mesh(vertices, self.faces)
        if "edges" in self.__dict__:
            moved.__dict__["edges"] = self.edges
        return moved

    @cached_property
    def used_vertices(self) -> Ints:
        """Vertices that some face uses, ascending, (u,)."""
        uses = np.bincount(self.faces.ravel(), minlength=len(self.vertices))
        return np.flatnonzero(uses).astype(np.int64)

    @cached_property
    def edges(self) -> Ints:
        """Undirected edges (e, 2), each once, smaller index first, in lexicographic order."""
        a, b, c = np.ascontiguousarray(self.faces.T)
        from_, to = np.concatenate([a, b, c]), np.concatenate([b, c, a])
        count = max(len(self.vertices), 1)
        keys = sorted_distinct(np.minimum(from_, to) * count + np.maximum(from_, to))
        edges = np.stack(np.divmod(keys, count), axis=1)
        return np.asarray(edges[edges[:, 0] != edges[:, 1]], dtype=np.int64)

    @cached_property
    def border_sides(self) -> Bools:
        """Whether no other face has a side, (m, 3); side k runs from corner k to the next."""
        next_corners = np.roll(self.faces, -1, axis=1)
        low, high = np.minimum(self.faces, next_corners), np.maximum(self.faces, next_corners)
        keys = (low * max(len(self.vertices), 1) + high).ravel()
        order = np.argsort(keys, kind="stable")
        first = np.diff(keys[order], prepend=-1) != 0
        last = np.append(first[1:], True) if len(first) else first
        alone = np.empty(len(keys), dtype=bool)
        alone[order] = first & last
        return alone.reshape(-1, 3)

    @cached_property
    def border_vertices(self) -> Bools:
        """Whether a vertex lies on an open border, (n,)."""
        found = np.zeros(len(self.vertices), dtype=bool)
        found[self.faces[self.border_sides]] = True
        found[np.roll(self.faces, -1, axis=1)[self.border_sides]] = True
        return found

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
