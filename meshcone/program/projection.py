"""Projection onto the dual cone K*, and its generalised derivative.

Zero cone: K* is everything. Non-negative and second-order cones are their own duals;
the projection onto the second-order cone and its Clarke derivative are the textbook
ones (Fukushima, Luo, Tseng 2002, "Smoothing functions for second-order-cone
complementarity problems", section 4).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from meshcone.program.cones import ConeType
from meshcone.surface.arrays import Floats


class _Family(Protocol):
    @property
    def cone(self) -> ConeType: ...
    @property
    def dimension(self) -> int: ...


class ConeRows(Protocol):
    """Consecutive rows of A that hold cones of one type and dimension."""

    @property
    def family(self) -> _Family:
        """The family they are from."""

    @property
    def size(self) -> int:
        """Number of rows."""


def split(vector: Floats, blocks: Sequence[ConeRows]) -> Iterator[tuple[ConeType, Floats]]:
    """Yield each block's part of a row vector (m,) as (cones, dimension)."""
    row = 0
    for block in blocks:
        part = vector[row : row + block.size].reshape(-1, block.family.dimension)
        yield block.family.cone, part
        row += block.size


def project_dual(vector: Floats, blocks: Sequence[ConeRows]) -> Floats:
    """Project a row vector (m,) onto K*."""
    parts = [_project(cone, part).ravel() for cone, part in split(vector, blocks)]
    return np.concatenate(parts) if parts else np.zeros(0)


def _project(cone: ConeType, part: Floats) -> Floats:
    if cone == "zero":
        return part
    if cone == "linear":
        return np.maximum(part, 0)
    tip, rest = part[:, 0], part[:, 1:]
    length = np.linalg.norm(rest, axis=1)
    scale = np.maximum((tip + length) / 2, 0)
    direction = rest / np.maximum(length, 1e-300)[:, None]
    outside = np.concatenate([scale[:, None], scale[:, None] * direction], axis=1)
    return np.where((length <= tip)[:, None], part, outside)


@dataclass(frozen=True)
class ProjectionDerivative:
    """An element V of the generalised Jacobian of :func:`project_dual` at a point.

    Attributes:
        blocks: the rows' cones.
        at: (m,) the point.
    """

    blocks: Sequence[ConeRows]
    at: Floats

    def apply(self, vector: Floats) -> Floats:
        """Return V times a row vector (m,)."""
        pairs = zip(split(self.at, self.blocks), split(vector, self.blocks), strict=True)
        parts = [_derivative(cone, at, part).ravel() for (cone, at), (_, part) in pairs]
        return np.concatenate(parts) if parts else np.zeros(0)

    def diagonal(self) -> Floats:
        """Return the diagonal of V, (m,)."""
        parts = [_derivative_diagonal(cone, at).ravel() for cone, at in split(self.at, self.blocks)]
        return np.concatenate(parts) if parts else np.zeros(0)


def _derivative(cone: ConeType, at: Floats, part: Floats) -> Floats:
    if cone == "zero":
        return part
    if cone == "linear":
        return np.where(at > 0, part, 0)
    inside, between, direction, ratio = _second_order_regions(at)
    along = np.einsum("ij,ij->i", direction, part[:, 1:])
    tip = (part[:, 0] + along) / 2
    rest = (
        direction * (part[:, 0] - ratio * along)[:, None] + (1 + ratio)[:, None] * part[:, 1:]
    ) / 2
    projected = np.concatenate([tip[:, None], rest], axis=1)
    return np.where(inside[:, None], part, np.where(between[:, None], projected, 0))


def _derivative_diagonal(cone: ConeType, at: Floats) -> Floats:
    if cone == "zero":
        return np.ones_like(at)
    if cone == "linear":
        return (at > 0).astype(np.float64)
    inside, between, direction, ratio = _second_order_regions(at)
    rest = (1 + ratio[:, None] * (1 - direction**2)) / 2
    projected = np.concatenate([np.full((len(at), 1), 0.5), rest], axis=1)
    return np.where(inside[:, None], 1.0, np.where(between[:, None], projected, 0))


def _second_order_regions(at: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    tip, rest = at[:, 0], at[:, 1:]
    length = np.linalg.norm(rest, axis=1)
    inside = length <= tip
    between = ~inside & (length > -tip)
    safe = np.maximum(length, 1e-300)
    return inside, between, rest / safe[:, None], np.clip(tip / safe, -1, 1)
