"""Triangles that a scene draws more than once, for several nodes use one mesh."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.scene import Scene
from meshcone.assets.weld import WeldedSurface
from meshcone.surface.subdivision import Subdivision


def twins(scene: Scene, surface: WeldedSurface) -> NDArray[np.int64]:
    """(m,) of each face of a scene's surface, the face that is the same triangle of the file.

    It is the first place at which the triangle is drawn; a triangle that has no area there, and
    has some elsewhere, is no twin.
    """
    found = np.arange(len(surface.kept), dtype=np.int64)
    first: dict[str, NDArray[np.int64]] = {}
    for pointer, _, faces in _drawn(scene, surface):
        known = first.setdefault(pointer, faces)
        if len(known) == len(faces):
            both = (known >= 0) & (faces >= 0)
            found[faces[both]] = known[both]
    return found


def divided_alike(scene: Scene, surface: WeldedSurface, subdivision: Subdivision) -> Subdivision:
    """Divide every face as the first that is the same triangle of the file is divided."""
    owners = twins(scene, surface)
    turned = np.zeros(len(owners), dtype=bool)
    for _, mirrored, faces in _drawn(scene, surface):
        turned[faces[faces >= 0]] = mirrored
    counts = np.bincount(subdivision.parents, minlength=subdivision.sources)
    starts = np.cumsum(counts) - counts
    parents = np.repeat(np.arange(len(owners)), counts[owners])
    ordinals = np.arange(len(parents)) - np.repeat(
        np.cumsum(counts[owners]) - counts[owners], counts[owners]
    )
    rows = starts[owners[parents]] + ordinals
    corners = subdivision.corners[rows]
    other_way = (turned != turned[owners])[parents]
    corners[other_way] = corners[other_way][:, ::-1, ::-1]
    own = owners[parents] == parents
    there = np.zeros(len(subdivision.parents), dtype=np.int64)
    there[rows[own]] = np.flatnonzero(own)
    slots = np.arange(3 * len(parents)).reshape(-1, 3)
    swapped = own & subdivision.swapped[rows]  # twins have no diagonal swapped
    taken = subdivision.slots[rows[swapped]]
    slots[swapped] = 3 * there[taken // 3] + taken % 3
    return Subdivision(subdivision.sources, parents, corners, subdivision.exponent, slots)


def _drawn(scene: Scene, surface: WeldedSurface) -> Iterator[tuple[str, bool, NDArray[np.int64]]]:
    """Of each primitive at each node: what it is, whether it is mirrored, and its faces, or −1."""
    face_of_row = np.full(len(surface.triangles), -1, dtype=np.int64)
    face_of_row[surface.kept] = np.arange(len(surface.kept))
    start = 0
    for placed in scene.primitives:
        end = start + len(placed.triangles)
        mirrored = scene.blocks[placed.block].placement.mirrored
        yield placed.primitive.element.pointer, mirrored, face_of_row[start:end]
        start = end
