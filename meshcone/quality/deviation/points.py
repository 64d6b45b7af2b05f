"""The points of a mesh whose distance has been asked for, and the farthest among them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.quality.deviation.placing import Placed
from meshcone.quality.deviation.triangles import Triangles
from meshcone.surface import SurfaceTree
from meshcone.surface.arrays import Floats, Ints


@dataclass(frozen=True)
class Hints:
    """What is known of two meshes already. Right or wrong, it only saves time.

    Attributes:
        tree: of the reference, in the meshes' unit.
        nearest: (n,) the reference's face closest to each vertex of the mesh.
    """

    tree: SurfaceTree
    nearest: Ints | None = None


class KnownPoints:
    """The vertices of a mesh and the ends of cuts, with the face suggested as closest to each.

    Attributes:
        positions: (n, 3); rows beyond the last point are room for more.
        nearest: (n,) the face of the other surface suggested as closest.
        distances: (n,) to that face, so never too small but for rounding; NaN before it was
            asked for.
        farthest: the largest distance met, of any point asked for; −1 before the first.
        farthest_at: (3,) that point.
        farthest_face: the face of the mesh it is on.
    """

    def __init__(self, placed: Placed, hints: Hints, triangles: Triangles) -> None:
        """Begin with the vertices of a mesh, asked for as far as there are hints."""
        mesh = placed.mesh
        self._placed, self._tree, self._triangles = placed, hints.tree, triangles
        self.positions = mesh.vertices
        self.distances = np.full(len(mesh.vertices), np.nan)
        self.nearest = np.zeros(len(mesh.vertices), dtype=np.int64)
        self._face = np.zeros(len(mesh.vertices), dtype=np.int64)
        self._face[mesh.faces.ravel()] = np.repeat(np.arange(len(mesh.faces)), 3)
        self.count = len(mesh.vertices)
        self.farthest, self.farthest_face = -1.0, 0
        self.farthest_at = mesh.corners[0, 0]
        if hints.nearest is not None:
            used = mesh.used_vertices
            self._take(used, hints.nearest[used])

    def look_up(self, rows: Ints) -> None:
        """Ask for points (k,)."""
        self._take(rows, self._suggested(self.positions[rows]))

    def _take(self, rows: Ints, nearest: Ints) -> None:
        positions = self.positions[rows]
        self.nearest[rows] = nearest
        self.distances[rows] = self._measured(positions, nearest, self._face[rows])

    def add(self, positions: Floats, faces: Ints) -> Ints:
        """Take new points (k, 3) on faces (k,) of the mesh and ask for them; their rows (k,)."""
        rows = np.arange(self.count, self.count + len(positions))
        self.count += len(positions)
        missing = self.count - len(self.positions)
        if missing > 0:
            room = max(len(self.positions), missing)
            self.positions = np.concatenate([self.positions, np.zeros((room, 3))])
            self.distances = np.concatenate([self.distances, np.full(room, np.nan)])
            self.nearest = np.concatenate([self.nearest, np.zeros(room, dtype=np.int64)])
            self._face = np.concatenate([self._face, np.zeros(room, dtype=np.int64)])
        self.positions[rows], self._face[rows] = positions, faces
        self.look_up(rows)
        return rows

    def ask(self, positions: Floats, faces: Ints) -> tuple[Ints, Floats]:
        """Suggest the closest face for each of (k, 3) points, with the distance to it, (k,) each.

        Args:
            positions: points of the mesh, which are not kept; but the farthest is.
            faces: (k,) of the mesh they are on.
        """
        nearest = self._suggested(positions)
        return nearest, self._measured(positions, nearest, faces)

    def _suggested(self, positions: Floats) -> Ints:
        if not len(positions):
            return np.empty(0, dtype=np.int64)
        points = positions * self._placed.unit + self._placed.origin
        return np.asarray(self._tree.closest(points).faces, dtype=np.int64)

    def _measured(self, positions: Floats, nearest: Ints, faces: Ints) -> Floats:
        distances = self._triangles.distances(positions, nearest)
        worst = int(distances.argmax()) if len(distances) else 0
        if len(distances) and distances[worst] > self.farthest:
            self.farthest, self.farthest_face = float(distances[worst]), int(faces[worst])
            self.farthest_at = positions[worst].copy()
        return distances
