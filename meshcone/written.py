"""A refined file as it was written, and where it has every copy of the vertices of its source."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import PurePath

import numpy as np

from meshcone.assets import Asset
from meshcone.errors import InputError, InternalError
from meshcone.pair import Pair
from meshcone.program.answer import RefinedPositions
from meshcone.report.report import OutputRecord
from meshcone.surface import Frame
from meshcone.surface.arrays import Floats, Ints, row_lengths
from meshcone.surface.similarity import rounding_of, transform_points

_ASTRAY = 1.0  # radii; no type of number in use is as coarse as the whole mesh


@dataclass(frozen=True)
class WrittenVertices:
    """The vertices of a patched copy of the source, where the alignment brings them.

    A vertex that several nodes or primitives share is stored once for each. The file may round
    its copies to different places; one of them stands for all in ``positions``, and what is said
    of the file has to hold for the others too.

    Attributes:
        positions: (n, 3) welded, in model units.
        seam: how far a copy is from the one that stands for it, at most, in model units.
        rounding: how far the positions may be from where the alignment brings them exactly,
            in model units.
    """

    positions: Floats
    seam: float
    rounding: float
    _copies: Floats = field(repr=False)
    _weld: Ints = field(repr=False)
    _frame: Frame = field(repr=False)

    @staticmethod
    def of(pair: Pair, written: Asset) -> WrittenVertices:
        """Take them from a patched copy that was read again."""
        weld = pair.source_asset.weld
        used = weld >= 0
        copies, weld = written.positions[used], weld[used]
        positions = np.empty_like(pair.source_asset.vertices)
        positions[weld] = copies
        apart, rounding = copies - positions[weld], 0.0
        if pair.alignment is not None:
            matrix = pair.alignment.matrix
            apart, rounding = apart @ matrix[:3, :3].T, rounding_of(matrix, copies)
            copies, positions = (transform_points(matrix, each) for each in (copies, positions))
        seam = float(row_lengths(apart).max(initial=0.0))
        return WrittenVertices(positions, seam, rounding, copies, weld, pair.frame)

    @property
    def in_frame(self) -> Floats:
        """(n, 3) ``positions`` in the frame, at the precision of the file."""
        return self._frame.into(self.positions)

    @property
    def uncertain(self) -> float:
        """How far the file's surface may lie from that of ``positions``, relative to the radius."""
        return (self.seam + self.rounding) / self._frame.radius

    def away_from(self, places: Floats) -> Floats:
        """How far the farthest copy of each vertex is from a place for it.

        Args:
            places: (n, 3) in the frame.

        Returns:
            (n,) distances in the frame.
        """
        lengths = row_lengths(self._frame.into(self._copies) - places[self._weld])
        farthest = np.zeros(len(places))
        np.maximum.at(farthest, self._weld, lengths)
        return farthest


@dataclass(frozen=True)
class WrittenFile:
    """The refined file, as written and as read again, and where it has its vertices."""

    record: OutputRecord
    data: bytes
    asset: Asset
    vertices: WrittenVertices


def write_refined(pair: Pair, solved: RefinedPositions) -> WrittenFile:
    """Write the answer into the source's file, or that file itself where it was kept.

    Raises:
        InternalError: what was written is not what is read back.
    """
    data = pair.source_file.data if solved.kept_input else pair.patched(solved.positions)
    record = OutputRecord(
        name=_refined_name(pair.source_asset.name),
        sha256=hashlib.sha256(data).hexdigest(),
        bytes=len(data),
    )
    try:
        asset = pair.read_patched(data)
    except InputError as error:  # the source could be read
        words = f"the refined file cannot be read back: {error.message}"
        raise InternalError(words, file=record.name, place=error.place) from error
    vertices = WrittenVertices.of(pair, asset)
    astray = float(vertices.away_from(solved.positions).max(initial=0.0))
    if astray > _ASTRAY:
        words = f"the refined file has a vertex {astray:.3g} radii from where it was to be"
        raise InternalError(words, file=record.name)
    return WrittenFile(record, data, asset, vertices)


def _refined_name(name: str) -> str:
    path = PurePath(name)
    return f"{path.stem}.refined{path.suffix}"
