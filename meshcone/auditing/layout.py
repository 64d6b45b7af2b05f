"""Where the texture coordinates of a mesh lie, as far as another triangulation keeps it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.content import Content, first_uses, placed

_SAME_AREA = 0.25
_SAME_PLACE = 0.1  # of the side of a square with the chart's area
_ONE_WAY = 0.5  # of the area runs more one way than the other


@dataclass(frozen=True)
class Layout:
    """A set of texture coordinates, summed over triangles.

    Attributes:
        area: covered, overlaps counted each time.
        signed: area that runs one way less that which runs the other.
        centre: (2,) mean by area.
    """

    area: float
    signed: float
    centre: tuple[float, float]

    def is_like(self, other: Layout) -> bool:
        """Whether both cover about the same of the texture, the same way round."""
        most = max(self.area, other.area)
        if abs(self.area - other.area) > _SAME_AREA * most:
            return False
        if self.signed * other.signed < 0 and all(
            abs(each.signed) > _ONE_WAY * each.area for each in (self, other)
        ):
            return False
        away = np.hypot(self.centre[0] - other.centre[0], self.centre[1] - other.centre[1])
        return bool(away <= _SAME_PLACE * np.sqrt(most))

    def words(self) -> str:
        """Area, place and direction."""
        turned = ", mirrored" if self.signed < 0 else ""
        return f"area {self.area:.3g} around ({self.centre[0]:.3g}, {self.centre[1]:.3g}){turned}"


@dataclass(frozen=True)
class Laid:
    """The layout of a set twice, because a transform can undo the units that a set is stored in.

    Attributes:
        stored: of the coordinates in the file.
        read: of what the first texture is read at through them.
    """

    stored: Layout
    read: Layout

    def is_like(self, other: Laid) -> bool:
        """Whether one of both is about the same."""
        return self.read.is_like(other.read) or self.stored.is_like(other.stored)

    def words(self) -> str:
        """Area, place and direction in the texture."""
        return self.read.words()


def layouts(content: Content, keys: list[str]) -> dict[str, Laid]:
    """The layout of each set of each mesh: ``mesh: NAME``.

    Args:
        content: of a file.
        keys: what its meshes are called.
    """
    corners: dict[str, list[NDArray[np.float64]]] = {}
    read: dict[str, list[NDArray[np.float64]]] = {}
    seen: set[tuple[int, int]] = set()
    for draw in content.draws:
        if (draw.mesh, draw.primitive) in seen:
            continue
        seen.add((draw.mesh, draw.primitive))
        textures = {} if draw.material is None else first_uses(content.materials[draw.material])
        uses = {f"TEXCOORD_{number}": use for number, use in textures.items()}
        for name, attribute in draw.attributes.items():
            if name.startswith("TEXCOORD_"):
                found = attribute.at_corners()[..., :2]
                found = found[:, ::-1] if draw.mirrored else found  # as the mesh is stored
                key = f"{keys[draw.mesh]}: {name}"
                corners.setdefault(key, []).append(found)
                read.setdefault(key, []).append(
                    placed(uses[name], found) if name in uses else found
                )
    return {
        key: Laid(_layout(np.concatenate(found)), _layout(np.concatenate(read[key])))
        for key, found in corners.items()
    }


def _layout(uv: NDArray[np.float64]) -> Layout:
    """Sum up (k, 3, 2) coordinates; triangles with one that is no number are left out."""
    uv = uv[np.isfinite(uv).all(axis=(1, 2))]
    first, second = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    signed = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    areas = np.abs(signed)
    total = float(areas.sum())
    if total == 0 or not np.isfinite(total):
        return Layout(0.0, 0.0, (0.0, 0.0))
    x, y = (areas @ uv.mean(axis=1) / total).tolist()
    return Layout(total, float(signed.sum()), (x, y))
