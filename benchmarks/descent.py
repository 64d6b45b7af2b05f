"""The measured distance itself brought down by L-BFGS: how close a mesh can come at all.

Nothing but the mean distance counts, so faces may fold. The optimum is a local one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.optimize import minimize

from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats, Ints
from meshcone.surface.box_tree import BoxTree

_SAMPLES = 20_000  # of each surface, drawn anew for each leg
_LEGS, _STEPS = 4, 50
_ROUNDING = 1e-9  # of the radius, squared: a distance has no derivative at 0


@dataclass(frozen=True)
class Distance:
    """Half the sum of the two directed mean distances, between samples that stay where they are.

    Attributes:
        mesh: the mesh that moves, at the beginning.
        own: (k, n) what of each vertex a sample of the moving mesh is.
        tree: closest points on the reference.
        theirs: (k, 3) samples of the reference.
    """

    mesh: Mesh
    own: sparse.csr_array
    tree: SurfaceTree
    theirs: Floats

    @staticmethod
    def drawn(mesh: Mesh, reference: Mesh, tree: SurfaceTree, seed: int) -> Distance:
        """Draw the samples."""
        faces, weights = _drawn(mesh, seed)
        theirs_on, theirs_weights = _drawn(reference, seed + 1)
        theirs = np.einsum(
            "kc,kcd->kd", theirs_weights, reference.vertices[reference.faces[theirs_on]]
        )
        return Distance(mesh, _corner_weights(mesh, faces, weights), tree, theirs)

    def at(self, flat: Floats) -> tuple[float, Floats]:
        """The distance of the mesh at positions (3n,) and its gradient."""
        vertices = flat.reshape(-1, 3)
        samples = self.own @ vertices
        out, gradient = _mean(samples - self.tree.closest(samples).points)
        slope = self.own.T @ gradient
        _, faces, points = BoxTree.of(vertices, self.mesh.faces).search(self.theirs)
        back, gradient = _mean(points - self.theirs)
        weights = _barycentric(points, vertices[self.mesh.faces[faces]])
        slope += _corner_weights(self.mesh, faces, weights).T @ gradient
        return (out + back) / 2, (slope / 2).ravel()


def descended(mesh: Mesh, reference: Mesh, tree: SurfaceTree, seed: int) -> tuple[float, Floats]:
    """The distance and the positions (n, 3) after some legs of L-BFGS.

    Each leg has samples of its own, and so has the distance in the end: what only the samples of a
    leg saw does not count.
    """
    vertices = mesh.vertices
    for leg in range(_LEGS):
        distance = Distance.drawn(mesh.moved_to(vertices), reference, tree, seed + 2 * leg)
        found = minimize(
            distance.at, vertices.ravel(), jac=True, method="L-BFGS-B", options={"maxiter": _STEPS}
        )
        vertices = found.x.reshape(-1, 3)
    unseen = Distance.drawn(mesh.moved_to(vertices), reference, tree, seed + 2 * _LEGS)
    return unseen.at(vertices.ravel())[0], vertices


def _drawn(mesh: Mesh, seed: int) -> tuple[Ints, Floats]:
    """Faces and barycentric coordinates of samples, uniform by area."""
    draw = np.random.default_rng(seed)
    faces = draw.choice(len(mesh.faces), _SAMPLES, p=mesh.face_areas / mesh.face_areas.sum())
    root, other = np.sqrt(draw.random(_SAMPLES)), draw.random(_SAMPLES)
    return faces, np.stack([1 - root, root * (1 - other), root * other], axis=1)


def _corner_weights(mesh: Mesh, faces: Ints, weights: Floats) -> sparse.csr_array:
    starts = np.arange(0, 3 * len(faces) + 1, 3)
    shape = (len(faces), len(mesh.vertices))
    return sparse.csr_array((weights.ravel(), mesh.faces[faces].ravel(), starts), shape=shape)


def _mean(offsets: Floats) -> tuple[float, Floats]:
    lengths = np.sqrt((offsets**2).sum(axis=1) + _ROUNDING**2)
    return float(lengths.mean()), offsets / lengths[:, None] / len(lengths)


def _barycentric(points: Floats, corners: Floats) -> Floats:
    """Coordinates (k, 3) of points on triangles (k, 3, 3).

    A triangle without area gives its first corner.
    """
    u, v, w = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    uu, uv, vv = (np.einsum("kd,kd->k", a, b) for a, b in ((u, u), (u, v), (v, v)))
    wu, wv = np.einsum("kd,kd->k", w, u), np.einsum("kd,kd->k", w, v)
    area = uu * vv - uv * uv
    flat = area <= 1e-24 * np.maximum(uu, vv) ** 2
    scale = np.where(flat, 1.0, area)
    second = np.where(flat, 0.0, (vv * wu - uv * wv) / scale)
    third = np.where(flat, 0.0, (uu * wv - uv * wu) / scale)
    return np.stack([1 - second - third, second, third], axis=1)
