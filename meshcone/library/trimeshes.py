"""What trimesh makes of a mesh, where it reads what the engine reads, and the engine's mesh else.

A second reader of a file can find something else in it: no faces in one of strips or with tabs,
other triangles in a concave polygon. What a caller gets is what was checked and refined.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh

from meshcone.assets.obj.asset import ObjAsset
from meshcone.assets.weld import group_equal_rows

if TYPE_CHECKING:
    from meshcone.assets.base import Asset
    from meshcone.surface.arrays import Floats

_GLTF = ("glb", "gltf")  # where nodes place geometries, as trimesh's own scenes have them


def scene_of(asset: Asset, resolver: Mapping[str, bytes]) -> trimesh.Scene:
    """All geometries of a file, with the triangles that the engine has.

    Args:
        asset: the file.
        resolver: the files that it names.
    """
    if asset.format in _GLTF:
        return _read(asset.file.data, asset.format, resolver)
    found: list[Any] = []
    for data in _texts(asset):
        try:
            scene = _read(data, asset.format, resolver)
        except Exception:  # noqa: BLE001, S112 - whatever it raises, there is the engine's mesh
            continue
        if _agrees(scene, asset):
            return scene
        found += scene.geometry.values()
    return trimesh.Scene(_cloud(asset) if asset.is_points else _built(asset, found))


def _texts(asset: Asset) -> Iterator[bytes]:
    yield asset.file.data
    if isinstance(asset, ObjAsset):
        yield asset.plain()


def _read(data: bytes, kind: str, resolver: Mapping[str, bytes]) -> trimesh.Scene:
    return trimesh.load_scene(
        io.BytesIO(data), file_type=kind, resolver=resolver, process=False, maintain_order=True
    )


def _agrees(scene: trimesh.Scene, asset: Asset) -> bool:
    if asset.is_points:
        clouds = list(scene.geometry.values())
        whole = len(clouds) == 1 and isinstance(clouds[0], trimesh.PointCloud)
        return whole and len(clouds[0].vertices) == asset.counts().vertices
    meshes = [each for each in scene.dump() if isinstance(each, trimesh.Trimesh)]
    if not meshes:
        return False
    theirs = _single(np.concatenate([each.triangles for each in meshes]))
    ours = _single(asset.positions[asset.triangles])
    if theirs.shape != ours.shape:
        return False
    return bool((theirs == ours).all()) or _same(theirs, ours)


def _single(points: Floats) -> Floats:
    # trimesh has the numbers of a text in the type that its header declares.
    with np.errstate(over="ignore"):
        return np.asarray(points).astype(np.float32).astype(np.float64) + 0.0


def _same(theirs: Floats, ours: Floats) -> bool:
    """Whether two lists have the same triangles (k, 3, 3), in any order and from any corner on."""
    numbers, _ = group_equal_rows(np.concatenate([theirs, ours]).reshape(-1, 3))
    one, other = (_sorted(each) for each in np.split(numbers.reshape(-1, 3), 2))
    return bool((one == other).all())


def _sorted(triangles: Any) -> Any:
    turned = np.stack([np.roll(triangles, turn, axis=1) for turn in range(3)])
    first = np.lexsort(turned.transpose(2, 0, 1)[::-1], axis=0)[0]
    rows = turned[first, np.arange(len(triangles))]
    return rows[np.lexsort(rows.T[::-1])]


def _built(asset: Asset, found: list[Any]) -> trimesh.Trimesh:
    """The engine's own mesh, with the colours of vertices that trimesh has found."""
    positions = asset.positions.copy()
    mesh = trimesh.Trimesh(positions, asset.triangles.copy(), process=False, validate=False)
    for geometry in found:
        colors = _colors(geometry)
        same = np.shape(geometry.vertices) == positions.shape
        if colors is None or not same:
            continue
        if np.array_equal(_single(geometry.vertices), _single(positions), equal_nan=True):
            mesh.visual.vertex_colors = colors
    return mesh


def _colors(geometry: Any) -> Any:
    if isinstance(geometry, trimesh.PointCloud):
        return geometry.colors if np.size(geometry.colors) else None
    return geometry.visual.vertex_colors if geometry.visual.kind == "vertex" else None


def _cloud(asset: Asset) -> trimesh.PointCloud:
    # The triangle of each point has it in its middle.
    return trimesh.PointCloud(asset.positions.reshape(-1, 3, 3).mean(axis=1))
