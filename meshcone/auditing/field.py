"""What a mesh has at its vertices, as sums over its surface, which other triangles keep."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.surface.arrays import Floats, Ints

_SAME_TILT = 30.0  # degrees, on average; noise tilts faces under their normals, too
_SAME_SIDES = 0.1  # of the area
_SAME_NUMBERS = 0.05  # of the area
_LEAST_LACKING = 1e-9  # of the area: what is less is rounding
_LEAST_SHIFT = 1e-4  # of the mesh's size: what adds less in a morph target is not told apart
_LEAST_TURN = 0.01


@dataclass(frozen=True)
class Kind:
    """How values of one kind are compared.

    Attributes:
        tolerance: how far sums may be apart, in units of the values.
        unit: of the values: that number; None for how large they are themselves.
        least: the smallest unit; of a shift, as a share of the mesh's size.
        is_shift: whether they are lengths, which are as large as the mesh is.
        is_layout: whether only how they run along the mesh counts, and their spread is the unit.
    """

    tolerance: float = 0.1
    unit: float | None = None
    least: float = 0.0
    is_shift: bool = False
    is_layout: bool = False


_KINDS = {
    "NORMAL": Kind(unit=1.0),
    "TANGENT": Kind(unit=1.0),
    "TEXCOORD": Kind(0.15, is_layout=True),
    "COLOR": Kind(0.05, unit=1.0),
}
_OWN = Kind()
_SHIFT = Kind(least=_LEAST_SHIFT, is_shift=True)
_TURN = Kind(0.2, least=_LEAST_TURN)


def kind_of(name: str) -> Kind:
    """How an attribute is compared, or what a morph target adds."""
    if name.startswith("target "):
        return _SHIFT if name.count(" ") == 1 else _TURN
    return _KINDS.get(name.partition("_")[0], _OWN)


@dataclass(frozen=True)
class Field:
    """Values over a surface.

    Attributes:
        kind: of the values.
        mean: (c,) by area.
        spread: root of the mean squared distance from it.
        along: (c, 6) how they run with x, y, z and with the distances from the middle along these:
            covariances with them, in units of the values; the mesh's size is 1.
        size: of the mesh: root of the mean squared distance from its middle.
        tilt: mean angle of normals to their faces in degrees; None for others.
        turned: share of the area where tangents are left-handed; None for others.
        lacking: share of the area where a value is no number; all else is of the rest.
    """

    kind: Kind
    mean: Floats
    spread: float
    along: Floats
    size: float
    tilt: float | None = None
    turned: float | None = None
    lacking: float = 0.0

    def is_like(self, other: Field) -> bool:
        """Whether a later field is about the same.

        However little of it is no number, it is another one if this is of numbers alone.
        """
        if len(self.mean) != len(other.mean):
            return False
        if other.lacking and not self.lacking:
            return False
        if abs(self.lacking - other.lacking) > _SAME_NUMBERS:
            return False
        if _apart(self.tilt, other.tilt) > _SAME_TILT:
            return False
        if _apart(self.turned, other.turned) > _SAME_SIDES:
            return False
        near = self.kind.tolerance * max(self._unit(), other._unit())
        if float(np.abs(self.along - other.along).max(initial=0.0)) > near:
            return False
        if self.kind.is_layout:
            return True
        far = float(np.abs(self.mean - other.mean).max(initial=0.0))
        return max(far, abs(self.spread - other.spread)) <= near

    def words(self) -> str:
        """Mean, spread, and how the values run along the mesh."""
        if not len(self.mean):
            return "no numbers"
        told = [f"mean {_numbers(self.mean)}", f"spread {self.spread:.3g}"]
        told.append("along x, y, z " + "; ".join(_numbers(row[:3]) for row in self.along))
        if self.tilt is not None:
            told.append(f"{self.tilt:.3g}° from the faces")
        if self.turned is not None:
            told.append(f"left-handed on {100 * self.turned:.3g} %")
        if self.lacking:
            told.append(f"no numbers on {100 * self.lacking:.3g} %")
        return ", ".join(told)

    def _unit(self) -> float:
        if self.kind.is_layout:
            return self.spread
        if self.kind.unit is not None:
            return self.kind.unit
        least = self.kind.least * (self.size if self.kind.is_shift else 1.0)
        return max(float(np.hypot(np.linalg.norm(self.mean), self.spread)), least)


@dataclass(frozen=True)
class Shares:
    """What part each row of values has in sums over triangles, whatever the values are.

    Attributes:
        rows: (r,) the rows that are at some corner.
        sums: (r, 7) integrals of each, which falls off to the other corners: by itself, times x,
            y and z, and times the squares of these.
        area: (r,) a third of that of the triangles around.
    """

    rows: Ints
    sums: Floats
    area: Floats

    @classmethod
    def of(cls, corners: Ints, places: Floats) -> Shares:
        """Those of (k, 3) rows at the corners of triangles.

        Args:
            corners: rows; -1 where there is none.
            places: (k, 3, 3) of the corners, from some origin.
        """
        known = (corners >= 0).all(axis=1) & np.isfinite(places).all(axis=(1, 2))
        corners, places = corners[known], places[known]
        sides = places[:, 1:] - places[:, :1]
        area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
        rows, which = np.unique(corners, return_inverse=True)
        which = which.reshape(corners.shape)
        # The middles of sides integrate what is linear, and products of two such, exactly.
        middles = (places + np.roll(places, -1, axis=1)) / 2
        at_sides = np.concatenate([np.ones((*corners.shape, 1)), middles, middles**2], axis=2)
        at_sides *= area[:, None, None] / 3
        at_corners = (at_sides + np.roll(at_sides, 1, axis=1)) / 2
        columns = [
            np.bincount(which.ravel(), at_corners[..., column].ravel(), len(rows))
            for column in range(at_corners.shape[2])
        ]
        own = np.bincount(which.ravel(), np.repeat(area / 3, 3), len(rows))
        return cls(rows, np.stack(columns, axis=1).astype(np.float64), own.astype(np.float64))


class FieldSum:
    """Adds up a field, some triangles after others."""

    def __init__(self, kind: Kind) -> None:
        self._kind = kind
        self._origin: Floats | None = None
        self._sums = np.zeros((7, 0))
        self._squares = self._turned = 0.0
        self._leaning = 0.0, 0.0  # degrees by area, and area
        self._has_turned = False
        self._lacking = 0.0

    def add(self, shares: Shares, values: Floats, turned: Floats | None = None) -> None:
        """Add triangles.

        Args:
            shares: what part each row has.
            values: (r, c) of these rows, all of them numbers.
            turned: (r,) 1 where a row is left-handed.
        """
        if not len(values):
            return
        if self._origin is None:
            self._origin = values[0]
            self._sums = np.zeros((7, 1 + values.shape[1]))
        there = values - self._origin
        self._sums[:, 0] += shares.sums.sum(axis=0)
        self._sums[:, 1:] += shares.sums.T @ there
        self._squares += float(shares.area @ (there**2).sum(axis=1))
        if turned is not None:
            self._has_turned = True
            self._turned += float(shares.area @ turned)

    def lean(self, tilt: Floats, area: Floats) -> None:
        """Add (k,) angles of normals to their faces, each by its area."""
        known = np.isfinite(tilt) & np.isfinite(area)
        degrees, whole = float(area[known] @ tilt[known]), float(area[known].sum())
        self._leaning = self._leaning[0] + degrees, self._leaning[1] + whole

    def lack(self, area: float) -> None:
        """Add the area of triangles with a value that is no number."""
        self._lacking += area

    def total(self) -> Field | None:
        """The field; None where nothing is known."""
        area = float(self._sums[0, 0]) if self._sums.size else 0.0
        lacking = self._lacking / ((self._lacking + area) or 1.0)
        if self._origin is None and self._lacking > 0:
            return Field(self._kind, np.zeros(0), 0.0, np.zeros((0, 6)), 0.0, lacking=lacking)
        if self._origin is None or not (area > 0 and np.isfinite(self._sums).all()):
            return None
        means = self._sums / area
        mean, places = means[0, 1:], means[1:, 0]
        middle, squares = places[:3], places[3:] - places[:3] ** 2
        linear = means[1:4, 1:] - middle[:, None] * mean
        square = means[4:, 1:] - 2 * middle[:, None] * means[1:4, 1:] + middle[:, None] ** 2 * mean
        square -= squares[:, None] * mean
        size = float(np.sqrt(max(squares.sum(), 0.0)))
        if not size > 0:
            return None
        along = np.concatenate([linear / size, square / size**2]).T
        spread = float(np.sqrt(max(self._squares / area - float(mean @ mean), 0.0)))
        return Field(
            kind=self._kind,
            mean=np.asarray(mean + self._origin),
            spread=spread,
            along=np.asarray(along),
            size=size,
            tilt=None
            if self._leaning is None or not self._leaning[1]
            else self._leaning[0] / self._leaning[1],
            turned=self._turned / area if self._has_turned else None,
            lacking=lacking if lacking > _LEAST_LACKING else 0.0,
        )


def _apart(here: float | None, there: float | None) -> float:
    return 0.0 if here is None or there is None else abs(here - there)


def _numbers(values: Floats) -> str:
    return " ".join(f"{round(value, 4) + 0.0:.3g}" for value in values.tolist())
