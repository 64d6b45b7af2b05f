"""Carries the normals rule over to glTF's NORMAL and TANGENT attributes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, decode
from meshcone.assets.gltf.scene import Block, Scene
from meshcone.assets.gltf.write import BufferEditor
from meshcone.assets.normals import realign_tangents, recompute_normals
from meshcone.assets.weld import WeldedSurface


@dataclass(frozen=True)
class _ShadedRun:
    """A NORMAL accessor over the vertices of a block: one shading vertex per element."""

    block: Block
    normal: Accessor
    start: int

    @property
    def rows(self) -> slice:
        return slice(self.start, self.start + self.normal.count)


def write_shading(
    editor: BufferEditor,
    scene: Scene,
    surface: WeldedSurface,
    vertices: NDArray[np.float64],
    selected: NDArray[np.bool_] | None,
) -> None:
    """Renew normals and tangents around vertices that moved.

    Normals are compared and averaged in world space, so a surface that continues from one
    node into the next is shaded as one.

    Args:
        editor: takes the changes.
        scene: as it was read.
        surface: its welded surface.
        vertices: (n, 3) new welded vertices.
        selected: (m,) faces whose shading may change, or None for all.
    """
    runs, corners = _shaded_runs(scene)
    if not runs:
        return
    stored = np.concatenate([_world_normals(editor, run) for run in runs.values()])
    weld = np.concatenate([surface.weld[run.block.rows] for run in runs.values()])
    normals, renewed = recompute_normals(
        surface.vertices, vertices, surface.faces, corners[surface.kept], weld, stored, selected
    )
    local: dict[tuple[int, int], NDArray[np.float64]] = {}
    for key, run in runs.items():
        rows = _renewed_rows(renewed, run)
        local[key] = run.block.pose.restore_normals(normals[run.rows][rows], rows)
        editor.store(run.normal, rows, local[key])
    written: set[tuple[int, int]] = set()
    for placed in scene.primitives:
        tangent, normal = placed.primitive.tangent, placed.primitive.normal
        if tangent is None or normal is None or (placed.block, tangent.index) in written:
            continue
        written.add((placed.block, tangent.index))
        key = (placed.block, normal.index)
        rows = _renewed_rows(renewed, runs[key])
        tangents = decode(editor.read(tangent), tangent.normalized)[rows]
        aligned, due = realign_tangents(tangents, local[key])
        editor.store(tangent, rows[due], aligned[due])


def _renewed_rows(renewed: NDArray[np.bool_], run: _ShadedRun) -> NDArray[np.int64]:
    """(k,) elements to write; none where a target adds to normals what nobody here undoes."""
    kept = run.block.pose.shift is not None
    return np.flatnonzero(renewed[run.rows] & (not kept))


def _shaded_runs(
    scene: Scene,
) -> tuple[dict[tuple[int, int], _ShadedRun], NDArray[np.int64]]:
    """Runs by (block, accessor), and (k, 3) the shading vertex at each triangle corner."""
    runs: dict[tuple[int, int], _ShadedRun] = {}
    corners = []
    total = 0
    for placed in scene.primitives:
        normal = placed.primitive.normal
        if normal is None:
            corners.append(np.full(placed.triangles.shape, -1, dtype=np.int64))
            continue
        block = scene.blocks[placed.block]
        key = (placed.block, normal.index)
        if key not in runs:
            runs[key] = _ShadedRun(block, normal, total)
            total += normal.count
        corners.append(placed.triangles - block.start + runs[key].start)
    return runs, np.concatenate(corners)


def _world_normals(editor: BufferEditor, run: _ShadedRun) -> NDArray[np.float64]:
    stored = decode(editor.read(run.normal), run.normal.normalized)
    return run.block.pose.turn_normals(stored)
