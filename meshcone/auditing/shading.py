"""The normals and tangents that an asset stores."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from meshcone.assets.content import Draw
from meshcone.auditing.records.shading import Shading
from meshcone.auditing.subject import Subject
from meshcone.surface.arrays import Bools, Floats, row_dot, row_lengths

_UNIT = 0.01  # more than this off 1 is no unit vector; 8 bits store one to .004


def shading_of(subject: Subject) -> Shading:
    """Count what shading would stumble over."""
    counts = dict.fromkeys((name for name in Shading.model_fields if name != _SHARE), 0)
    for draw in subject.content.draws:
        for name, found in _counts(subject, draw):
            counts[name] += found
    stored = counts["corners"] - counts["without_normals"] - counts["zero_normals"]
    share = counts["opposed_normals"] / stored if stored else 0.0
    return Shading.model_validate({**counts, _SHARE: share})


_SHARE = "opposed_normals_share"


def _counts(subject: Subject, draw: Draw) -> Iterator[tuple[str, int]]:
    solid = subject.solid[draw.rows]
    corners = 3 * int(np.count_nonzero(solid))
    yield "corners", corners
    normals = subject.corners(draw, "NORMAL")
    if normals is None:
        yield "without_normals", corners
    else:
        faces = np.repeat(subject.listed.face_normals[draw.rows][solid], 3, axis=0)
        absent = draw.attributes["NORMAL"].corners[solid].ravel() < 0
        yield from _normals(_world(draw, normals[solid].reshape(-1, 3)), faces, absent)
    tangents = subject.corners(draw, "TANGENT")
    if tangents is not None:
        yield from _tangents(tangents[solid].reshape(-1, tangents.shape[2]))
    elif _has_normal_map(subject, draw):
        yield "without_tangents", corners


def _normals(normals: Floats, faces: Floats, absent: Bools) -> Iterator[tuple[str, int]]:
    # A normal that is stored and no number is there, and wrong.
    lengths = row_lengths(normals)
    usable = np.isfinite(lengths) & (lengths > 0)
    yield "without_normals", int(np.count_nonzero(absent))
    yield "zero_normals", int(np.count_nonzero(~usable & ~absent))
    yield "not_unit_normals", int(np.count_nonzero(np.abs(lengths[usable] - 1) > _UNIT))
    yield "opposed_normals", int(np.count_nonzero(row_dot(normals, faces)[usable] < 0))


def _tangents(tangents: Floats) -> Iterator[tuple[str, int]]:
    lengths = row_lengths(tangents[:, :3])
    usable = np.isfinite(lengths) & (lengths > 0)
    yield "zero_tangents", int(np.count_nonzero(~usable))
    yield "not_unit_tangents", int(np.count_nonzero(np.abs(lengths[usable] - 1) > _UNIT))
    if tangents.shape[1] > 3:
        yield "wrong_handedness", int(np.count_nonzero(np.abs(tangents[:, 3]) != 1))


def _world(draw: Draw, normals: Floats) -> Floats:
    """Normals turned as their node turns them, with the lengths that the file has."""
    if np.array_equal(draw.matrix, np.eye(4)):
        return normals
    # A normal is a covector: it turns by the transposed inverse, here by cofactors, which
    # exist for flattening nodes too. A mirrored node has had its triangles turned around.
    linear = draw.matrix[:3, :3]
    cofactors = np.stack(
        [np.cross(linear[:, (i + 1) % 3], linear[:, (i + 2) % 3]) for i in range(3)], axis=1
    )
    cofactors *= np.sign(np.linalg.det(linear)) or 1.0
    turned = normals @ cofactors.T
    lengths = row_lengths(turned)
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = np.where(lengths > 0, row_lengths(normals) / lengths, 1.0)
    return np.asarray(turned * scale[:, None])


def _has_normal_map(subject: Subject, draw: Draw) -> bool:
    if draw.material is None:
        return False
    return subject.content.materials[draw.material].texture("normal") is not None
