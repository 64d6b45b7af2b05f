"""The inputs of the paper's experiments: unfinished deformations of a sphere, and Poisson's meshes.

The paper deforms "a sphere toward target meshes [...], stopping early". Its library's tutorial
does that by descending the chamfer distance of samples, held back by the edges' lengths and the
Laplacian; weights, step and momentum here are the tutorial's. Its fourth term, on the normals of
neighbouring faces at a weight of 0.01, is left out.
"""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
from reference_shapes import sphere
from scipy import sparse
from scipy.spatial import KDTree

from meshcone.surface import Mesh, sample_surface
from meshcone.surface.arrays import Floats, normalized

# Chamfer distance 1, edges 1, Laplacian 0.1; plain descent with momentum.
_EDGE_WEIGHT, _LAPLACIAN_WEIGHT = 1.0, 0.1
_STEP, _MOMENTUM = 1.0, 0.9
_TARGET_SAMPLES, _SAMPLES = 5000, 2000
_SPHERE_VERTICES = 2562
STEPS = 100  # of the tutorial's 2,000
_CLOUD_POINTS, _OCTREE_DEPTH = 10_000, 8


def own_sphere(_: Mesh) -> Mesh:
    """The tutorial's icosphere; its faces are not the target's."""
    return sphere(_SPHERE_VERTICES)


def same_size_sphere(target: Mesh) -> Mesh:
    """The target's faces with every vertex moved out to the unit sphere.

    This is how a sphere has "the same size as the target meshes", as the paper asks.
    """
    return target.moved_to(normalized(target.vertices))


def deformed(start: Mesh, target: Mesh, steps: int = STEPS) -> Mesh:
    """Move a mesh some steps towards a target, both in the target's unit sphere."""
    goal = sample_surface(target, _TARGET_SAMPLES, seed=0, method="random").points
    goal_tree = KDTree(goal)
    differences = _differences(start)
    averages = _neighbour_averages(start)
    positions, velocity = start.vertices, np.zeros_like(start.vertices)
    for step in range(steps):
        gradient = (
            _chamfer_gradient(start.moved_to(positions), goal, goal_tree, seed=step)
            + _EDGE_WEIGHT
            * (2 / differences.shape[0])
            * (differences.T @ (differences @ positions))
            + _LAPLACIAN_WEIGHT * _laplacian_gradient(averages, positions)
        )
        velocity = _MOMENTUM * velocity + gradient
        positions = positions - _STEP * velocity
    return start.moved_to(positions)


def has_poisson() -> bool:
    """Whether the library of the ``bench`` extra that reconstructs by Poisson is installed."""
    return find_spec("pymeshlab") is not None


def poisson(target: Mesh) -> Mesh:
    """Screened Poisson reconstruction of 10,000 points of the target with their normals."""
    import pymeshlab  # noqa: TID251 - this is where it is compared with

    cloud = sample_surface(target, _CLOUD_POINTS, seed=0, method="random")
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=cloud.points, v_normals_matrix=cloud.normals))
    meshes.generate_surface_reconstruction_screened_poisson(depth=_OCTREE_DEPTH, threads=1)
    made = meshes.current_mesh()
    return Mesh(made.vertex_matrix(), made.face_matrix())


def _chamfer_gradient(mesh: Mesh, goal: Floats, goal_tree: KDTree, seed: int) -> Floats:
    """Gradient (n, 3) of mean d² from samples to the goal's points plus that of the other way."""
    samples = sample_surface(mesh, _SAMPLES, seed, method="random")
    _, nearest_goal = goal_tree.query(samples.points)
    _, nearest_sample = KDTree(samples.points).query(goal)
    pulls = 2 / len(samples.points) * (samples.points - goal[nearest_goal])
    back = 2 / len(goal) * (samples.points[nearest_sample] - goal)
    for axis in range(3):
        pulls[:, axis] += np.bincount(nearest_sample, back[:, axis], minlength=len(pulls))
    corners = mesh.faces[samples.faces]
    weights = _barycentric(samples.points, mesh.vertices[corners])
    count = len(mesh.vertices)
    spread = sparse.csr_array(
        (weights.ravel(), (corners.ravel(), np.repeat(np.arange(len(pulls)), 3))),
        shape=(count, len(pulls)),
    )
    return np.asarray(spread @ pulls)


def _barycentric(points: Floats, corners: Floats) -> Floats:
    """Weights (k, 3) of points (k, 3) in their triangles (k, 3, 3)."""
    arms = corners - points[:, None]
    areas = np.linalg.norm(np.cross(np.roll(arms, -1, axis=1), np.roll(arms, -2, axis=1)), axis=2)
    return np.asarray(areas / np.maximum(areas.sum(axis=1, keepdims=True), 1e-300))


def _edge_gradient(differences: sparse.csr_array, positions: Floats) -> Floats:
    """Gradient of the mean squared length of the edges."""
    return np.asarray(2 / differences.shape[0] * (differences.T @ (differences @ positions)))


def _laplacian_gradient(averages: sparse.csr_array, positions: Floats) -> Floats:
    """Gradient of the mean length of the vectors from vertices to their neighbours' means."""
    directions = normalized(averages @ positions - positions)
    return np.asarray((averages.T @ directions - directions) / len(positions))


def _differences(mesh: Mesh) -> sparse.csr_array:
    edges = mesh.edges
    rows = np.repeat(np.arange(len(edges)), 2)
    signs = np.tile([1.0, -1.0], len(edges))
    return sparse.csr_array((signs, (rows, edges.ravel())), shape=(len(edges), len(mesh.vertices)))


def _neighbour_averages(mesh: Mesh) -> sparse.csr_array:
    count, edges = len(mesh.vertices), mesh.edges
    ends = np.concatenate([edges, edges[:, ::-1]])
    valences = np.maximum(np.bincount(edges.ravel(), minlength=count), 1)
    return sparse.csr_array((1 / valences[ends[:, 0]], ends.T), shape=(count, count))
