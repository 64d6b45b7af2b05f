"""Warnings for a source that is its reference turned, moved, mirrored or in other units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from meshcone.notices import Code, WarningRecord, warning
from meshcone.surface import Frame
from meshcone.surface.arrays import Floats
from meshcone.surface.motion import Motion, MotionSearch
from meshcone.surface.similarity import invert, scale_of

# What a length is multiplied by where a unit was mistaken.
_FACTORS = {
    10.0: Code.UNITS_FACTOR_10,
    100.0: Code.UNITS_FACTOR_100,
    1000.0: Code.UNITS_FACTOR_1000,
    25.4: Code.UNITS_FACTOR_25_4,
}
_FACTOR_TOLERANCE = 0.02
# Relative to the reference's radius: less than this is no move, and no digit worth telling.
_NO_MOVE = 1e-3
_NOISE = 0.02
# A turn by less has no angle that could be told.
_ROUNDING = 1e-9
_AXES = "XYZ"


@dataclass(frozen=True)
class Pose:
    """How the source lies if the reference is taken as it should be.

    Attributes:
        to_reference: (4, 4) from the source to the reference, both in the frame.
        warnings: one for each code that the motion has; the words are the whole of it.
    """

    to_reference: Floats
    warnings: tuple[WarningRecord, ...]


def unit_factor(ratio: float) -> Code | None:
    """The code of a ratio of sizes that a mistaken unit explains, within 2 %."""
    for factor, code in _FACTORS.items():
        if abs(max(ratio, 1 / ratio) / factor - 1) <= _FACTOR_TOLERANCE:
            return code
    return None


def size_in_words(ratio: float) -> str:
    """A ratio of sizes as part of a sentence: ``100 times`` or ``1/100 of``."""
    factor = max(ratio, 1 / ratio)
    nearest = min(_FACTORS, key=lambda known: abs(factor / known - 1))
    if abs(factor / nearest - 1) <= _NO_MOVE:
        factor = nearest
    return f"{factor:.4g} times" if ratio > 1 else f"1/{factor:.4g} of"


def find_pose(search: MotionSearch, frame: Frame) -> Pose | None:
    """Say by which motion the source differs from the reference; None where by none.

    Args:
        search: the two surfaces, in the frame.
        frame: that leads back to model units, in which motions are told.
    """
    found = search.find()
    if found is None:
        return None
    placed, rounded = _rounded(search, found, frame)
    parts = list(placed.parts(digits=4 if rounded.exact else 3))
    if not parts:
        return None
    words = " and ".join(words for _, words in parts)
    likeness = "the same shape as" if rounded.exact else "nearly the same shape as"
    sentence = f"The source is {likeness} the reference, {words}.{_remedy(parts)}"
    return Pose(
        to_reference=rounded.matrix,
        warnings=tuple(warning(code, "pair", sentence) for code, _ in parts),
    )


def _rounded(search: MotionSearch, found: Motion, frame: Frame) -> tuple[_Placed, Motion]:
    """The motion in the roundest numbers that explain it."""
    for tolerance in (_NOISE, _NO_MOVE):
        # Told is what became of the reference; searched for was the way back.
        placed = _Placed.of(invert(found.matrix), frame, tolerance)
        rounded = search.replaced(found, invert(placed.matrix(frame)))
        if rounded is not None:
            return placed, rounded
    return _Placed.of(invert(found.matrix), frame, 0.0), found


def _remedy(parts: list[tuple[Code, str]]) -> str:
    codes = {code for code, _ in parts}
    if Code.POSE_MIRRORED in codes:
        return ""
    mode = "rigid" if codes <= {Code.POSE_TURNED, Code.POSE_MOVED} else "similarity"
    return f" Set align={mode} to undo that."


@dataclass(frozen=True)
class _Placed:
    """x ↦ s Q x + t from the reference to the source, in model units.

    Attributes:
        scale: s.
        turn: Q, (3, 3) orthogonal.
        shift: t, (3,).
        centre: (3,) the centre of the reference's box.
        radius: of the reference.
    """

    scale: float
    turn: Floats
    shift: Floats
    centre: Floats
    radius: float

    @staticmethod
    def of(matrix: Floats, frame: Frame, tolerance: float) -> _Placed:
        """Take a (4, 4) similarity of the frame apart, and round to what is within a tolerance."""
        scale = _rounded_scale(scale_of(matrix), tolerance)
        turn = matrix[:3, :3] / scale_of(matrix)
        whole = np.round(turn)
        turn = whole if np.abs(turn - whole).max() <= tolerance else turn
        centre, radius = frame.centre, frame.radius
        moved = matrix[:3, 3] * radius + centre  # where the centre goes
        shift = moved - scale * turn @ centre
        small = tolerance * radius * max(scale, 1)
        # A motion about the origin or about the centre moves nothing else.
        if np.abs(moved - centre).max() <= small:
            shift = centre - scale * turn @ centre
        else:
            shift = np.where(np.abs(shift) <= small, 0.0, shift)
        return _Placed(scale, turn, shift, centre, radius)

    def matrix(self, frame: Frame) -> Floats:
        """The (4, 4) similarity in the frame."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.scale * self.turn
        moved = self.scale * self.turn @ frame.centre + self.shift
        matrix[:3, 3] = (moved - frame.centre) / frame.radius
        return matrix

    def parts(self, digits: int) -> Iterator[tuple[Code, str]]:
        """Each part of the motion, with its code."""
        mirrored = np.linalg.det(self.turn) < 0
        turn, across = _unmirrored(self.turn) if mirrored else (self.turn, "")
        if self.scale != 1:
            code = unit_factor(self.scale) or Code.POSE_SCALED
            yield code, f"{size_in_words(self.scale)} the size"
        if mirrored:
            yield Code.POSE_MIRRORED, f"mirrored along {across}"
        if np.abs(turn - np.eye(3)).max() > _ROUNDING:
            yield Code.POSE_TURNED, f"turned by {_turn_in_words(turn, digits)}"
        if self._moves():
            numbers = ", ".join(f"{value + 0.0:.{digits}g}" for value in self.shift)
            yield Code.POSE_MOVED, f"moved by ({numbers})"

    def _moves(self) -> bool:
        about_centre = self.centre - self.scale * self.turn @ self.centre
        others = np.abs(self.shift - about_centre).max() > _NO_MOVE * self.radius
        return bool(self.shift.any() and others)


def _rounded_scale(scale: float, tolerance: float) -> float:
    for factor in (1.0, *_FACTORS, *(1 / factor for factor in _FACTORS)):
        if abs(scale / factor - 1) <= tolerance:
            return factor
    return scale


def _unmirrored(turn: Floats) -> tuple[Floats, str]:
    """The turn that is left after mirroring along the axis that leaves least of it."""
    mirrors = [np.diag(np.where(np.arange(3) == axis, -1.0, 1.0)) for axis in range(3)]
    axis = max(range(3), key=lambda axis: float(np.trace(turn @ mirrors[axis])))
    return turn @ mirrors[axis], _AXES[axis]


def _turn_in_words(turn: Floats, digits: int) -> str:
    vector = Rotation.from_matrix(turn).as_rotvec(degrees=True)
    angle = float(np.linalg.norm(vector))
    axis = vector / angle
    axis[np.abs(axis) < _NO_MOVE] = 0.0
    if abs(angle - 180) < _NO_MOVE:
        axis = np.abs(axis) if np.count_nonzero(axis) == 1 else axis
    [along] = np.nonzero(axis)
    if len(along) == 1:
        return f"{angle * np.sign(axis[along[0]]):.{digits}g}° about {_AXES[along[0]]}"
    numbers = ", ".join(f"{value + 0.0:.3g}" for value in axis / np.abs(axis).max())
    return f"{angle:.{digits}g}° about ({numbers})"
