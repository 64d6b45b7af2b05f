"""Faces that two meshes have in common."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshcone.quality.deviation.triangles import corners_among
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, Ints

_Hashes = NDArray[np.uint64]


def equal_faces(mesh: Mesh, other: Mesh) -> Ints:
    """For each face of a mesh one of the other with the same three corners, or −1; (m,).

    Found by hashes, then compared coordinate by coordinate.
    """
    mine, theirs = _hashes(mesh.corners), _hashes(other.corners)
    order = np.argsort(theirs, kind="stable")
    place = np.minimum(np.searchsorted(theirs[order], mine), len(theirs) - 1)
    candidate = order[place]
    alike = np.flatnonzero(theirs[candidate] == mine)
    same = corners_among(mesh.corners[alike], other.corners[candidate[alike]])
    found = np.full(len(mine), -1)
    found[alike[same]] = candidate[alike[same]]
    return found


def _hashes(corners: Floats) -> _Hashes:
    """A hash of each face that its corners give in any order, (m,)."""
    bits = (np.ascontiguousarray(corners) + 0.0).view(np.uint64)  # + 0.0: -0 becomes 0
    with np.errstate(over="ignore"):
        x, y, z = bits[..., 0], bits[..., 1], bits[..., 2]
        hashed = x * np.uint64(0x9E3779B97F4A7C15)
        hashed = (hashed ^ (hashed >> np.uint64(29)) ^ y) * np.uint64(0xBF58476D1CE4E5B9)
        hashed = (hashed ^ (hashed >> np.uint64(32)) ^ z) * np.uint64(0x94D049BB133111EB)
        hashed ^= hashed >> np.uint64(31)
        return np.asarray(hashed.sum(axis=1) + hashed.prod(axis=1))
