"""Vertex attributes between vertices, each in the way that its meaning asks for.

Source: Khronos glTF 2.0 Specification (ISO/IEC 12113:2022), sections 3.7.2 and 3.7.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, decode, encode
from meshcone.errors import InputError
from meshcone.surface.subdivision import DividedFaces

_LINEAR = ("POSITION", "TEXCOORD_", "COLOR_")
_AS_FLOATS = ("POSITION", "TEXCOORD_")  # half a step of these is seen
_SHORTEST = 1e-6  # of a direction; a shorter one is that of the first vertex


@dataclass(frozen=True)
class Influences:
    """Joints and weights at new vertices, and the largest share of a weight that had no room."""

    joints: NDArray[np.int64]
    weights: NDArray[np.float64]
    lost: float


def extended(
    name: str, accessor: Accessor, stored: NDArray[Any], points: DividedFaces, *, morphs: bool
) -> NDArray[Any]:
    """Append what an attribute is at new vertices.

    Positions and texture coordinates that are stored as integers become floats. Normals,
    tangents and colours keep their type, to half a step of it.

    Args:
        name: of the attribute, such as ``NORMAL``.
        accessor: where it is stored.
        stored: (n, columns) its components.
        points: the new vertices.
        morphs: whether the values are displacements of a morph target.

    Returns:
        (n + k, columns) components.

    Raises:
        InputError: nothing lies between the values: an identifier, or tangents of two signs.
    """
    if not (name.startswith(_LINEAR) or name in ("NORMAL", "TANGENT")):
        return _apart(name, accessor, stored, points)
    values = decode(stored, accessor.normalized)
    between = _between(values, points)
    if not morphs and name in ("NORMAL", "TANGENT"):
        between[:, :3] = _directions(between[:, :3], values[points.corners[:, 0], :3])
    if not morphs and name == "TANGENT":
        between[:, 3] = _signs(accessor, values, points)
    if stored.dtype.kind != "f" and name.startswith(_AS_FLOATS):
        return np.concatenate([values, between]).astype("<f4")
    if stored.dtype.kind == "f":
        return np.concatenate([stored, between.astype(stored.dtype)])
    new = encode(between, accessor.component, accessor.normalized)
    assert new is not None  # noqa: S101 - it lies between values that are stored so
    return np.concatenate([stored, new])


def influences(
    joints: NDArray[np.int64], weights: NDArray[np.float64], points: DividedFaces
) -> Influences:
    """Merge the joints of the vertices that new ones lie between, the heaviest first.

    Args:
        joints: (n, s) of every set.
        weights: (n, s) how much each vertex follows them.
        points: the new vertices.

    Returns:
        (k, s) joints and weights that add up to 1 for each vertex, or to 0 where no vertex
        beside it follows any joint.
    """
    room = joints.shape[1]
    shares = points.weights / 2.0**points.exponent
    found = joints[points.corners].reshape(len(shares), 3 * room)
    with np.errstate(invalid="ignore"):  # none where one is not finite
        heavy = (weights[points.corners] * shares[:, :, None]).reshape(found.shape)
    order = np.argsort(found, axis=1, kind="stable")
    found = np.take_along_axis(found, order, axis=1)
    heavy = np.take_along_axis(heavy, order, axis=1)
    for column in range(1, found.shape[1]):  # of equal joints the last takes it all
        same = found[:, column] == found[:, column - 1]
        heavy[:, column] += np.where(same, heavy[:, column - 1], 0.0)
        heavy[:, column - 1] = np.where(same, 0.0, heavy[:, column - 1])
    order = np.argsort(-heavy, axis=1, kind="stable")[:, :room]
    kept = np.take_along_axis(heavy, order, axis=1)
    total, left = heavy.sum(axis=1), kept.sum(axis=1)
    lost = float((1 - left / np.where(total > 0, total, 1.0))[total > 0].max(initial=0.0))
    chosen = np.where(kept > 0, np.take_along_axis(found, order, axis=1), 0)
    scaled = kept / np.where(left > 0, left, 1.0)[:, None]
    return Influences(chosen, scaled, max(lost, 0.0))


def encoded_weights(weights: NDArray[np.float64], component: np.dtype[Any]) -> NDArray[Any]:
    """Store (k, s) weights so that integers add up to exactly what 1 is (section 3.7.3.3)."""
    if component.kind == "f":
        return weights.astype(component)
    most = int(np.iinfo(component).max)
    steps = np.rint(weights * most).astype(np.int64)
    steps[:, 0] += np.where(steps.sum(axis=1) > 0, most - steps.sum(axis=1), 0)
    return steps.astype(component)


def _between(values: NDArray[np.float64], points: DividedFaces) -> NDArray[np.float64]:
    """(k, c) what lies between values (n, c): no number where one of them is not finite."""
    with np.errstate(invalid="ignore"):
        return points.interpolated(values)


def _directions(between: NDArray[np.float64], first: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale directions (k, 3) to unit length; where there is none, take those of a vertex."""
    lengths = np.linalg.norm(between, axis=1, keepdims=True)
    known = (lengths > _SHORTEST) & np.isfinite(lengths)
    unit = np.where(known, between, 0.0) / np.where(known, lengths, 1.0)
    return np.asarray(np.where(known, unit, first))


def _signs(
    accessor: Accessor, values: NDArray[np.float64], points: DividedFaces
) -> NDArray[np.float64]:
    """The handedness (k,) of tangents, which all vertices beside a new one must agree on."""
    signs = values[points.corners, 3]
    known = np.isfinite(signs)
    least, most = np.where(known, signs, np.inf), np.where(known, signs, -np.inf)
    if (least.min(axis=1) < most.max(axis=1)).any():
        raise InputError(
            "TANGENT has different signs at the ends of an edge to divide: split the vertices "
            "where texture coordinates are mirrored",
            place=accessor.element.pointer,
        )
    return np.asarray(signs[:, 0])


def _apart(
    name: str, accessor: Accessor, stored: NDArray[Any], points: DividedFaces
) -> NDArray[Any]:
    """Append values of an attribute of the application's own: numbers, or identifiers."""
    around = stored[points.corners]
    first = around[:, :1]
    if ((around == first) | ((around != around) & (first != first))).all():  # NaN is not itself
        return np.concatenate([stored, around[:, 0]])
    identifies = name.startswith(("_FEATURE_ID", "_BATCHID")) or stored.dtype.kind != "f"
    if identifies:
        raise InputError(
            f"{name[:40]} differs along an edge to divide, and no identifier lies between two",
            place=accessor.element.pointer,
        )
    between = _between(decode(stored, accessor.normalized), points)
    return np.concatenate([stored, between.astype("<f4")])
