"""Projection onto the dual cone K*, and its generalised derivative.

Zero cone: K* is everything. Non-negative and second-order cones are their own duals;
the projection onto the second-order cone and its Clarke derivative are the textbook
ones (Fukushima, Luo, Tseng 2002, "Smoothing functions for second-order-cone
complementarity problems", section 4).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np
from scipy import sparse

from meshcone.program.cones import ConeType
from meshcone.surface.arrays import Bools, Floats, row_lengths


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
    length = row_lengths(rest)
    scale = np.maximum((tip + length) / 2, 0)
    direction = rest / np.maximum(length, 1e-300)[:, None]
    outside = np.concatenate([scale[:, None], scale[:, None] * direction], axis=1)
    return np.where((length <= tip)[:, None], part, outside)


def projection_derivative(at: Floats, blocks: Sequence[ConeRows]) -> sparse.csr_array:
    """Write an element V (m, m) of the generalised Jacobian of :func:`project_dual`.

    Args:
        at: (m,) the point it is taken at.
        blocks: the rows' cones.
    """
    entries, columns, lengths, row = [], [], [], 0
    for cone, part in split(at, blocks):
        places = row + np.arange(part.size).reshape(part.shape)
        entries.append(_derivative(cone, part).ravel())
        columns.append(np.repeat(places, part.shape[1], axis=0).ravel())
        lengths.append(np.full(part.size, part.shape[1]))
        row += part.size
    offsets = np.concatenate([[0], np.cumsum(np.concatenate(lengths))])
    data = (np.concatenate(entries), np.concatenate(columns), offsets)
    return sparse.csr_array(data, shape=(row, row))


def _derivative(cone: ConeType, at: Floats) -> Floats:
    """Return the derivative of each cone's projection, (cones, dimension, dimension)."""
    if cone != "second_order":
        free = np.ones_like(at) if cone == "zero" else (at > 0).astype(np.float64)
        return free[:, :, None] * np.eye(at.shape[1])
    inside, between, direction, ratio = _second_order_regions(at)
    identity = np.eye(at.shape[1] - 1)
    along = direction[:, :, None] * direction[:, None, :]
    ratio = ratio[:, None, None]
    result = np.zeros((len(at), at.shape[1], at.shape[1]))
    result[:, 0, 0] = 1
    result[:, 0, 1:] = result[:, 1:, 0] = direction
    result[:, 1:, 1:] = (1 + ratio) * identity - ratio * along
    result *= np.where(between, 0.5, 0)[:, None, None]
    result[inside] = np.eye(at.shape[1])
    return result


def _second_order_regions(at: Floats) -> tuple[Bools, Bools, Floats, Floats]:
    tip, rest = at[:, 0], at[:, 1:]
    length = row_lengths(rest)
    inside = length <= tip
    between = ~inside & (length > -tip)
    safe = np.maximum(length, 1e-300)
    return inside, between, rest / safe[:, None], np.clip(tip / safe, -1, 1)
