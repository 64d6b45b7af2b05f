"""Warnings for parts that one of two surfaces lacks.

A part is what the file names, or, of that, what hangs together: a wheel is missed in a file
that has everything in one mesh too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from meshcone.notices import Code, Side, Told, WarningRecord, warning
from meshcone.quality.parts import Partition, PartSamples
from meshcone.surface import Frame, Mesh, SurfaceTree
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot

# A file of more parts is foliage or noise, and each part of it says little.
_MOST_PARTS = 1000
_SAMPLES = 2000
_TOLD = 10
# Where more of the area is absent, the two are different shapes.
_MOST_ABSENT = 0.5
# Relative to the radius: what a piece lies nearer to than this is what it stands for.
_NEAR = 0.02
_NEARLY_ALL = 0.9
# Where more of the area is turned, all of the mesh is, which is told elsewhere.
_MOST_TURNED = 0.6
_DOUBLED = 0.02
# Faces that are asked which way they are turned: together, and of every piece.
_FACES, _LEAST = 5000, 8


@dataclass(frozen=True)
class PartedMesh:
    """A mesh in the frame, with its tree and the parts that its file names."""

    mesh: Mesh
    tree: SurfaceTree
    names: Partition


def piece_warnings(source: PartedMesh, reference: PartedMesh, frame: Frame) -> Told:
    """Name the parts that one side has and the other lacks."""
    found = {
        Code.PIECES_MISSING: _absent(reference, source),
        Code.PIECES_EXTRA: _absent(source, reference),
    }
    not_examined = {code for code, absent in found.items() if absent is None}
    if not_examined:
        not_examined.add(Code.PIECES_DISPLACED)
    lacking, besides = (absent or [] for absent in found.values())
    told = _told_of_all(source, reference, lacking, besides, frame)
    return Told(list(told), frozenset(not_examined))


def _told_of_all(
    source: PartedMesh,
    reference: PartedMesh,
    lacking: list[_Piece],
    besides: list[_Piece],
    frame: Frame,
) -> Iterator[WarningRecord]:
    here, there = set(source.names.names) - {""}, set(reference.names.names) - {""}
    missing = [each for each in lacking if each.name not in here]
    yield from _told(Code.PIECES_MISSING, "reference", missing, "{}: missing.", frame)
    extra = [each for each in besides if each.name not in there]
    words = "{}: the reference has nothing there."
    yield from _told(Code.PIECES_EXTRA, "source", extra, words, frame)
    both = {each.name: each for each in (*lacking, *besides) if each.name in here & there}
    words = "{}: elsewhere than in the reference, or of another shape."
    yield from _told(Code.PIECES_DISPLACED, "source", list(both.values()), words, frame)
    words = "{}: its faces are turned the other way round than the reference's."
    yield from _told(Code.NORMALS_OPPOSED, "source", _turned(source, reference), words, frame)


@dataclass(frozen=True)
class _Piece:
    """A part to warn of: a whole named part, or a piece of one.

    Attributes:
        name: of the named part; empty where it has none, or where only a piece is meant.
        owner: the named part.
        middle: (3,) in the frame.
    """

    name: str
    owner: str
    middle: Floats

    def called(self, frame: Frame) -> str:
        if self.name:
            return self.name
        x, y, z = frame.out_of(self.middle[None])[0]
        of = f" of {self.owner}" if self.owner else ""
        return f"A piece{of} near ({x:.3g}, {y:.3g}, {z:.3g})"


def _absent(parted: PartedMesh, other: PartedMesh) -> list[_Piece] | None:
    """The parts of one mesh that another lacks; None where that says nothing."""
    pieces = _pieces(parted)
    if len(pieces.names) <= 1:
        return []
    if len(pieces.names) > _MOST_PARTS:
        return None
    samples = PartSamples.of(parted.mesh, pieces, other.tree, _SAMPLES, vertices=False)
    absent = samples.absent(set(other.names.names))
    areas = samples.areas
    if areas[absent].sum() > _MOST_ABSENT * areas.sum():
        return None
    return list(_by_name(parted.mesh, pieces, absent, areas > 0))


def _turned(source: PartedMesh, reference: PartedMesh) -> list[_Piece]:
    """The pieces of the source whose faces oppose the reference's; none where most do."""
    pieces = _pieces(source)
    if not 1 < len(pieces.names) <= _MOST_PARTS or _is_doubled(source) or _is_doubled(reference):
        return []
    chosen = _chosen(pieces.labels)
    near, opposed = _agreement(source, reference, chosen)
    weights, labels = source.mesh.face_areas[chosen], pieces.labels[chosen]
    areas, close, against = (
        np.bincount(labels, weights * which, len(pieces.names))
        for which in (np.ones(len(chosen)), near, near & opposed)
    )
    if against.sum() > _MOST_TURNED * areas.sum():
        return []
    turned = (areas > 0) & (close >= _NEARLY_ALL * areas) & (against >= _NEARLY_ALL * areas)
    return list(_by_name(source.mesh, pieces, turned, areas > 0))


def _chosen(labels: Ints) -> Ints:
    """Faces of every piece, some thousands of all together."""
    order = np.argsort(labels, kind="stable")
    bounds = np.searchsorted(labels[order], np.arange(labels.max() + 2))
    some = [np.linspace(first, last - 1, _LEAST) for first, last in pairwise(bounds.tolist())]
    spread = np.arange(0, len(order), -(-len(order) // _FACES))
    return np.asarray(order[np.unique(np.concatenate([*some, spread]).astype(np.int64))])


def _agreement(mesh: PartedMesh, other: PartedMesh, faces: Ints) -> tuple[Bools, Bools]:
    """(k,) which faces lie near the other mesh, and which of them oppose what is closest."""
    closest = other.tree.closest(mesh.mesh.corners[faces].mean(axis=1))
    normals = other.mesh.face_normals[closest.faces]
    opposed = row_dot(mesh.mesh.face_normals[faces], normals) < 0
    return closest.distances <= _NEAR, opposed


def _is_doubled(parted: PartedMesh) -> bool:
    """Whether faces lie back to back in one place, so that which is closest means nothing."""
    faces = np.arange(0, len(parted.mesh.faces), -(-len(parted.mesh.faces) // _FACES))
    _, opposed = _agreement(parted, parted, faces)
    areas = parted.mesh.face_areas[faces]
    return bool(areas @ opposed > _DOUBLED * areas.sum())


def _by_name(mesh: Mesh, pieces: Partition, meant: Bools, given: Bools) -> Iterator[_Piece]:
    """The pieces that are meant; those of one name together if all that are given are."""
    centres = mesh.corners.mean(axis=1)

    def middle(parts: list[int]) -> Floats:
        points = centres[np.isin(pieces.labels, parts)]
        return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)

    for name in dict.fromkeys(pieces.names):
        own = np.array([each == name for each in pieces.names]) & given
        parts = np.flatnonzero(own & meant).tolist()
        if name and parts and len(parts) == np.count_nonzero(own):
            yield _Piece(name, name, middle(parts))
        else:
            yield from (_Piece("", name, middle([part])) for part in parts)


def _pieces(parted: PartedMesh) -> Partition:
    """What hangs together within each named part; several pieces can have one name."""
    faces, names = parted.mesh.faces, parted.names
    count = len(parted.mesh.vertices)
    ends = np.concatenate([faces[:, :2], faces[:, 1:]])
    graph = coo_array((np.ones(len(ends), dtype=bool), ends.T), shape=(count, count))
    _, components = connected_components(graph, directed=False)
    keys = names.labels * count + components[faces[:, 0]]
    distinct, labels = np.unique(keys, return_inverse=True)
    return Partition(tuple(names.names[key // count] for key in distinct), labels)


def _told(
    code: Code, side: Side, absent: Sequence[_Piece], words: str, frame: Frame
) -> Iterator[WarningRecord]:
    for each in absent[:_TOLD]:
        called = each.called(frame)
        yield warning(code, side, words.format(called), where=each.name or called)
    if len(absent) > _TOLD:
        left = f"{len(absent) - _TOLD:,} more parts"
        yield warning(code, side, words.format(left))
