"""Seeded ways a mesh is worse than its reference.

Distances are relative to the reference's radius; the reference is in its own frame.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import igl
import numpy as np
from scipy import sparse

from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats, normalized

_SPIKED_SHARE, _SPIKE_LENGTH = 0.01, 0.2
_SMOOTHING_STEPS, _SMOOTHING_FACTOR = 100, 0.5
_KEPT_SHARE, _DECIMATION_NOISE = 0.25, 0.01
_GRID_CELLS = 64
# The level is a little outside the surface, so that sheets without thickness have a volume.
_LEVEL_IN_CELLS = 0.3
_GRID_MARGIN = 0.1


def noise_2(reference: Mesh) -> Mesh:
    """Gaussian noise of 2 % of the radius on every coordinate."""
    return _noisy(reference, 0.02)


def noise_05(reference: Mesh) -> Mesh:
    """Gaussian noise of 0.5 % of the radius on every coordinate."""
    return _noisy(reference, 0.005)


def spikes(reference: Mesh) -> Mesh:
    """One vertex in a hundred moved by a fifth of the radius in any direction."""
    generator = np.random.default_rng(2)
    count = len(reference.vertices)
    chosen = generator.choice(count, max(1, int(count * _SPIKED_SHARE)), replace=False)
    spiked = reference.vertices.copy()
    spiked[chosen] += _SPIKE_LENGTH * normalized(generator.normal(size=(len(chosen), 3)))
    return reference.moved_to(spiked)


def smoothing(reference: Mesh) -> Mesh:
    """Over-smoothed by 100 half steps towards the mean of the neighbours."""
    return reference.moved_to(smoothed(reference, [_SMOOTHING_FACTOR] * _SMOOTHING_STEPS))


def decimation(reference: Mesh) -> Mesh:
    """A quarter of the faces, by quadric error, with noise of 1 % of the radius."""
    import fast_simplification

    points, faces = fast_simplification.simplify(
        reference.vertices.astype(np.float32),
        reference.faces.astype(np.int32),
        target_reduction=1 - _KEPT_SHARE,
    )
    noise = np.random.default_rng(3).normal(size=points.shape) * _DECIMATION_NOISE
    return Mesh(points + noise, faces)


def marching_cubes(reference: Mesh) -> Mesh:
    """Marching cubes of the signed distance on 64 cells along the longest side."""
    from skimage.measure import marching_cubes as extract

    vertices, faces = reference.vertices, reference.faces
    low, high = vertices.min(axis=0) - _GRID_MARGIN, vertices.max(axis=0) + _GRID_MARGIN
    cell = float((high - low).max()) / _GRID_CELLS
    shape = np.ceil((high - low) / cell).astype(int) + 1
    axes = [low[k] + cell * np.arange(shape[k]) for k in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    distances = SurfaceTree(reference).closest(grid).distances
    inside = igl.fast_winding_number(vertices, faces, np.ascontiguousarray(grid)) > 0.5
    signed = np.where(inside, -distances, distances).reshape(shape)
    points, triangles, _, _ = extract(signed, _LEVEL_IN_CELLS * cell, spacing=(cell,) * 3)
    return Mesh(points + low, triangles[:, ::-1])


DEGRADATIONS: dict[str, Callable[[Mesh], Mesh]] = {
    "noise_2": noise_2,
    "noise_05": noise_05,
    "spikes": spikes,
    "smoothing": smoothing,
    "decimation": decimation,
    "marching_cubes": marching_cubes,
}
_NEEDED = {"decimation": "fast_simplification", "marching_cubes": "skimage"}


def missing_library(degradation: str) -> str | None:
    """Name the library of the ``bench`` extra a degradation needs, if it is not installed."""
    library = _NEEDED.get(degradation)
    return library if library is not None and find_spec(library) is None else None


def degraded(reference: Mesh, degradation: str, cache: Path | None) -> Mesh:
    """Degrade a reference, or read what an earlier run made of the same reference.

    Args:
        reference: in its own frame.
        degradation: a key of :data:`DEGRADATIONS`.
        cache: directory of earlier runs' meshes, or None to make each anew.
    """
    if cache is None:
        return DEGRADATIONS[degradation](reference)
    content = reference.vertices.tobytes() + reference.faces.tobytes()
    path = cache / f"{degradation}-{hashlib.sha256(content).hexdigest()[:16]}.npz"
    if path.exists():
        with np.load(path) as stored:
            return Mesh(stored["vertices"], stored["faces"])
    made = DEGRADATIONS[degradation](reference)
    cache.mkdir(parents=True, exist_ok=True)
    np.savez(path, vertices=made.vertices, faces=made.faces)
    return made


def smoothed(mesh: Mesh, factors: list[float]) -> Floats:
    """Positions after steps of the given factors towards the mean of the neighbours, (n, 3)."""
    count, edges = len(mesh.vertices), mesh.edges
    ends = np.concatenate([edges, edges[:, ::-1]])
    adjacency = sparse.coo_array(
        (np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count)
    ).tocsr()
    degree = np.bincount(edges.ravel(), minlength=count)[:, None]
    positions = mesh.vertices
    for factor in factors:
        step = adjacency @ positions / np.maximum(degree, 1) - positions
        positions = positions + factor * np.where(degree > 0, step, 0.0)
    return positions


def _noisy(reference: Mesh, deviation: float) -> Mesh:
    noise = np.random.default_rng(1).normal(size=reference.vertices.shape)
    return reference.moved_to(reference.vertices + deviation * noise)
