"""Warnings for parts that one of two surfaces lacks.

A part is what the file names, or, of that, what hangs together: a wheel is missed in a file
that has everything in one mesh too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from meshcone.notices import Code, Side, WarningRecord, warning
from meshcone.quality.parts import Partition, PartSamples
from meshcone.surface import Frame, Mesh, SurfaceTree
from meshcone.surface.arrays import Floats

# A file of more parts is foliage or noise, and each part of it says little.
_MOST_PARTS = 1000
_SAMPLES = 2000
_TOLD = 10
# Where more of the area is absent, the two are different shapes.
_MOST_ABSENT = 0.5


@dataclass(frozen=True)
class PartedMesh:
    """A mesh in the frame, with its tree and the parts that its file names."""

    mesh: Mesh
    tree: SurfaceTree
    names: Partition


def piece_warnings(
    source: PartedMesh, reference: PartedMesh, frame: Frame
) -> Iterator[WarningRecord]:
    """Name the parts that one side has and the other lacks."""
    lacking, besides = _absent(reference, source), _absent(source, reference)
    here, there = set(source.names.names) - {""}, set(reference.names.names) - {""}
    missing = [each for each in lacking if each.name not in here]
    yield from _told(Code.PIECES_MISSING, "reference", missing, "{}: missing.", frame)
    extra = [each for each in besides if each.name not in there]
    words = "{}: the reference has nothing there."
    yield from _told(Code.PIECES_EXTRA, "source", extra, words, frame)
    both = {each.name: each for each in (*lacking, *besides) if each.name in here & there}
    words = "{}: elsewhere than in the reference, or of another shape."
    yield from _told(Code.PIECES_DISPLACED, "source", list(both.values()), words, frame)


@dataclass(frozen=True)
class _Absent:
    """A part that the other side lacks: a whole named part, or a piece of one.

    Attributes:
        name: of the named part; empty where it has none, or where only a piece is absent.
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


def _absent(parted: PartedMesh, other: PartedMesh) -> list[_Absent]:
    """The parts of one mesh that another lacks; none where that says nothing."""
    pieces = _pieces(parted)
    if not 1 < len(pieces.names) <= _MOST_PARTS:
        return []
    samples = PartSamples.of(parted.mesh, pieces, other.tree, _SAMPLES, vertices=False)
    absent = samples.absent(set(other.names.names))
    areas = samples.areas
    if areas[absent].sum() > _MOST_ABSENT * areas.sum():
        return []
    found = []
    for name in dict.fromkeys(pieces.names):
        own = np.array([each == name for each in pieces.names]) & (areas > 0)
        gone = np.flatnonzero(own & absent).tolist()
        if name and gone and len(gone) == np.count_nonzero(own):
            found.append(_Absent(name, name, _middle(samples, gone)))
        else:
            found += [_Absent("", name, _middle(samples, [part])) for part in gone]
    return found


def _middle(samples: PartSamples, parts: Iterable[int]) -> Floats:
    points = np.concatenate([samples.of_part(part)[0] for part in parts])
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)


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
    code: Code, side: Side, absent: Sequence[_Absent], words: str, frame: Frame
) -> Iterator[WarningRecord]:
    for each in absent[:_TOLD]:
        called = each.called(frame)
        yield warning(code, side, words.format(called), where=each.name or called)
    if len(absent) > _TOLD:
        left = f"{len(absent) - _TOLD:,} more parts"
        yield warning(code, side, words.format(left))
