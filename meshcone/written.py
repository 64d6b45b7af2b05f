"""Where a file that was written has the vertices of its source, with every copy that it stores."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from meshcone.assets import Asset
from meshcone.pair import Pair
from meshcone.surface import Frame
from meshcone.surface.arrays import Floats, Ints, row_lengths
from meshcone.surface.similarity import rounding_of, transform_points


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
