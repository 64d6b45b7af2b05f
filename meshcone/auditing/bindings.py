"""Which part of a mesh follows which joint, as far as another triangulation keeps it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets import Asset
from meshcone.assets.content import Content, Draw
from meshcone.auditing.naming import unique_labels

_SAME_SHARE = 0.05
_SAME_PLACE = 0.1
_SETS = 2
_JOINTS = 1024  # of a skin, told though nothing follows them


@dataclass(frozen=True)
class Binding:
    """What follows one joint, summed over triangles.

    Attributes:
        share: of the mesh's area, by weight.
        centre: (3,) mean place of that, by area and weight, from the mesh's own centre and in
            sides of a square with its area: another place or size of the whole is no other binding.
    """

    share: float
    centre: tuple[float, float, float]

    def is_like(self, other: Binding) -> bool:
        """Whether about the same part follows the joint."""
        if abs(self.share - other.share) > _SAME_SHARE:
            return False
        if max(self.share, other.share) <= _SAME_SHARE:
            return True
        away = float(np.linalg.norm(np.subtract(self.centre, other.centre)))
        return away <= _SAME_PLACE

    def words(self) -> str:
        """How much, and where."""
        x, y, z = self.centre
        return f"{100 * self.share:.3g} % of the mesh, around ({x:.3g}, {y:.3g}, {z:.3g})"


def bindings(asset: Asset, content: Content, keys: list[str]) -> dict[str, Binding]:
    """What follows each joint: ``mesh: joint``.

    Args:
        asset: whose positions count, as they are read.
        content: of the same file.
        keys: what its meshes are called.
    """
    labels = unique_labels(content)
    # By mesh and joint: area by weight, then that times x, y, z.
    weighted: dict[tuple[str, str], NDArray[np.float64]] = {}
    wholes: dict[str, NDArray[np.float64]] = {}  # area, then that times x, y, z
    skinned: set[tuple[str, int]] = set()
    for draw in content.draws:
        node = None if draw.node is None else content.nodes[draw.node]
        if node is None or node.skin is None:
            continue
        joints = content.skins[node.skin].joints
        corners = asset.positions[asset.triangles[draw.rows]]
        found = _of_draw(draw, corners)
        if found is None:
            continue
        whole, numbers, sums = found
        mesh = keys[draw.mesh]
        # A joint that nothing follows counts as well: all may follow it in the other file.
        if (mesh, node.skin) not in skinned:
            skinned.add((mesh, node.skin))
            for joint in joints[:_JOINTS]:
                weighted.setdefault((mesh, labels[joint]), np.zeros(4))
        wholes[mesh] = wholes.get(mesh, np.zeros(4)) + whole
        for number, each in zip(numbers, sums, strict=True):
            if number < len(joints):
                key = mesh, labels[joints[number]]
                weighted[key] = weighted.get(key, np.zeros(4)) + each
    return {
        f"{mesh}: {joint}": _binding(found, wholes[mesh])
        for (mesh, joint), found in weighted.items()
    }


def _of_draw(
    draw: Draw, corners: NDArray[np.float64]
) -> tuple[NDArray[np.float64], list[int], NDArray[np.float64]] | None:
    """Area and moments (4,), joints, and (j, 4) theirs by weight; None without weights.

    Where weights are no numbers nothing follows any joint.
    """
    sets = [
        (draw.attributes[f"JOINTS_{n}"].at_corners(), draw.attributes[f"WEIGHTS_{n}"].at_corners())
        for n in range(_SETS)
        if f"JOINTS_{n}" in draw.attributes and f"WEIGHTS_{n}" in draw.attributes
    ]
    if not sets or not len(corners):
        return None
    joints = np.concatenate([each for each, _ in sets], axis=2)
    weights = np.concatenate([each for _, each in sets], axis=2)
    placed = np.isfinite(corners).all(axis=(1, 2))
    joints, weights, corners = joints[placed], weights[placed], corners[placed]
    usable = (np.isfinite(joints) & np.isfinite(weights)).all(axis=2, keepdims=True)
    joints, weights = np.where(usable, joints, 0.0), np.where(usable, weights, 0.0)
    total = np.abs(weights).sum(axis=2, keepdims=True)
    sides = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    portion = area[:, None, None] / 3 * np.divide(weights, np.where(total > 0, total, 1.0))
    numbers, which = np.unique(joints.astype(np.int64), return_inverse=True)
    which, portion = which.reshape(joints.shape), portion.reshape(joints.shape)
    moments = [portion, *(portion * corners[:, :, axis, None] for axis in range(3))]
    columns = [np.bincount(which.ravel(), each.ravel(), len(numbers)) for each in moments]
    sums = np.stack(columns, axis=1).astype(np.float64)
    whole = np.append(area.sum(), area @ corners.mean(axis=1))
    return whole, numbers.tolist(), sums


def _binding(found: NDArray[np.float64], whole: NDArray[np.float64]) -> Binding:
    if found[0] <= 0 or whole[0] <= 0:
        return Binding(0.0, (0.0, 0.0, 0.0))
    x, y, z = ((found[1:] / found[0] - whole[1:] / whole[0]) / np.sqrt(whole[0])).tolist()
    return Binding(float(found[0] / whole[0]), (x, y, z))
