"""Where a mesh has its materials, and what of it has its attributes, whatever its triangles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from meshcone.assets import Asset
from meshcone.assets.content import Content, Draw, target_called
from meshcone.surface.arrays import Bools, Floats

SAME_SHARE = 0.05
_SAME_PLACE = 0.1
_SMALL = 0.01  # of the area: a coarser level of detail leaves some of such a part away
_MOMENTS = 7  # area, that times x, y, z, and that times their squares
DEFAULT = "the default"  # material


@dataclass(frozen=True)
class Part:
    """What of a mesh has one material, summed over triangles.

    Attributes:
        share: of the mesh's area.
        lies: (6,) mean place, from the mesh's own centre, and spread along each axis, in sides of
            a square with its area: another place or size of the whole is no other part.
    """

    share: float
    lies: tuple[float, ...]

    def is_like(self, other: Part) -> bool:
        """Whether about the same of the mesh has the material."""
        if abs(self.share - other.share) > SAME_SHARE:
            return False
        if max(self.share, other.share) <= _SMALL:
            return True
        here, there = np.array(self.lies), np.array(other.lies)
        away = np.linalg.norm((here - there).reshape(2, 3), axis=1)
        return bool((away <= _SAME_PLACE).all())

    def words(self) -> str:
        """How much, and where."""
        x, y, z = self.lies[:3]
        return f"{100 * self.share:.3g} % of the mesh, around ({x:.3g}, {y:.3g}, {z:.3g})"


@dataclass(frozen=True)
class Painted:
    """Where one mesh has each of its materials.

    Attributes:
        frames: parts by their materials: as the mesh is drawn where it is drawn first, and as it
            is stored, which does not depend on where that is.
    """

    frames: tuple[Mapping[str, Part], Mapping[str, Part]]

    def is_like(self, other: Painted) -> bool:
        """Whether each material is about where it was; which there are is not compared."""
        return next(self._elsewhere(other), None) is None

    def has_materials_of(self, other: Painted) -> bool:
        """Whether both have the same materials, wherever."""
        return self.frames[0].keys() == other.frames[0].keys()

    def words(self) -> str:
        """Each material and where it is."""
        return "; ".join(f"'{name}' on {part.words()}" for name, part in self.frames[0].items())

    def _elsewhere(self, other: Painted) -> Iterator[str]:
        if not self.has_materials_of(other):
            return  # another set of materials is told by itself
        for name in self.frames[0]:
            pairs = zip(self.frames, other.frames, strict=True)
            if not any(here[name].is_like(there[name]) for here, there in pairs):
                yield name


@dataclass(frozen=True)
class Carried:
    """What of one mesh has an attribute.

    Attributes:
        shares: of the area, by material, and of the whole mesh as ``None``.
    """

    shares: Mapping[str | None, float]

    def less_than(self, other: Carried, *, painted_alike: bool) -> str | None:
        """Where this has clearly less, in words; None where it has not.

        Args:
            other: what has more, perhaps.
            painted_alike: whether a material is on the same of both, so that it can be told apart.
        """
        for name in self.shares if painted_alike else [None]:
            if name not in other.shares:
                continue
            here, there = self.shares[name], other.shares[name]
            if there - here > SAME_SHARE:
                what = "the mesh" if name is None else f"what has material '{name}'"
                return f"{100 * here:.3g} % of {what}, and not {100 * there:.3g} %"
        return None


@dataclass
class _Sums:
    """Of one mesh.

    Attributes:
        drawn, stored: (7,) moments by material, as :class:`Painted` has its frames.
        area: by material.
        carried: area that has an attribute, by its name and then by material.
    """

    drawn: dict[str, Floats] = field(default_factory=dict)
    stored: dict[str, Floats] = field(default_factory=dict)
    area: dict[str, float] = field(default_factory=dict)
    carried: dict[str, dict[str, float]] = field(default_factory=dict)


class Parts:
    """The parts of the meshes of a file.

    Args:
        asset: whose positions count, as they are read.
        content: of the same file.
        meshes: what its meshes are called.
        materials: what its materials are called.
        moved: (4, 4) what its positions are moved by before they are compared, if by anything.
    """

    def __init__(
        self,
        asset: Asset,
        content: Content,
        meshes: Sequence[str],
        materials: Sequence[str],
        moved: Floats | None = None,
    ) -> None:
        self._sums: dict[str, _Sums] = {}
        seen: set[tuple[int, int]] = set()
        for draw in content.draws:
            if (draw.mesh, draw.primitive) in seen:
                continue
            seen.add((draw.mesh, draw.primitive))
            corners = asset.positions[asset.triangles[draw.rows]]
            material = DEFAULT if draw.material is None else materials[draw.material]
            primitive = content.meshes[draw.mesh].primitives[draw.primitive]
            sums = self._sums.setdefault(meshes[draw.mesh], _Sums())
            finite: Bools = np.asarray(np.isfinite(corners).all(axis=(1, 2)))
            _add(sums, draw, corners[finite], finite, material, moved)
            # Morph targets and attributes of an application's own are for all vertices alike.
            alike = [target_called(number) for number in range(primitive.targets)]
            alike += [name for name in primitive.attributes if name.startswith("_")]
            for name in [each for each in alike if each not in draw.others]:
                _carry(sums, name, material, float(_area(corners[finite]).sum()))

    @cached_property
    def painted(self) -> dict[str, Painted]:
        """Where each mesh that is drawn has its materials."""
        return {
            key: Painted((_parts(sums.drawn), _parts(sums.stored)))
            for key, sums in self._sums.items()
            if sum(sums.area.values()) > 0
        }

    def painted_alike(self, other: Parts, mesh: str) -> bool:
        """Whether a mesh has the same materials in both files, and about where it had them."""
        here, there = self.painted.get(mesh), other.painted.get(mesh)
        if here is None or there is None:
            return False
        return here.has_materials_of(there) and here.is_like(there)

    def carried(self, mesh: str, attribute: str) -> Carried | None:
        """What of a mesh has an attribute; None where nothing of it is drawn."""
        sums = self._sums.get(mesh)
        if sums is None or not sum(sums.area.values()) > 0:
            return None
        found = sums.carried.get(attribute, {})
        shares: dict[str | None, float] = {None: sum(found.values()) / sum(sums.area.values())}
        for material, area in sums.area.items():
            if area > 0:
                shares[material] = found.get(material, 0.0) / area
        return Carried(shares)


def _add(
    sums: _Sums, draw: Draw, corners: Floats, finite: Bools, material: str, moved: Floats | None
) -> None:
    area = _area(corners)
    sums.area[material] = sums.area.get(material, 0.0) + float(area.sum())
    for moments, matrix in ((sums.drawn, moved), (sums.stored, _inverse(draw.matrix))):
        placed = corners if matrix is None else corners @ matrix[:3, :3].T + matrix[:3, 3]
        moments[material] = moments.get(material, np.zeros(_MOMENTS)) + _moments(placed)
    for name, attribute in {**draw.attributes, **draw.others}.items():
        has = (attribute.corners[finite] >= 0).all(axis=1)
        _carry(sums, name, material, float(area[has].sum()))


def _carry(sums: _Sums, attribute: str, material: str, area: float) -> None:
    found = sums.carried.setdefault(attribute, {})
    found[material] = found.get(material, 0.0) + area


def _inverse(matrix: Floats) -> Floats | None:
    try:
        return np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    except np.linalg.LinAlgError:
        return None


def _area(corners: Floats) -> Floats:
    sides = corners[:, 1:] - corners[:, :1]
    area: Floats = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    return area


def _moments(corners: Floats) -> Floats:
    """(7,) area of triangles, and the integrals of x, y, z and of their squares over them."""
    area = _area(corners)
    total = corners.sum(axis=1)
    squares = ((corners**2).sum(axis=1) + total**2) / 12
    return np.concatenate([[area.sum()], area @ (total / 3), area @ squares])


def _parts(moments: Mapping[str, Floats]) -> dict[str, Part]:
    whole = np.sum(list(moments.values()), axis=0)
    side, centre = np.sqrt(whole[0]), whole[1:4] / max(whole[0], np.finfo(float).tiny)
    found = {}
    for name, sums in moments.items():
        if not (sums[0] > 0 and side > 0):
            found[name] = Part(0.0, (0.0,) * 6)
            continue
        mean = sums[1:4] / sums[0]
        spread = np.sqrt(np.maximum(sums[4:] / sums[0] - mean**2, 0.0))
        lies = np.concatenate([mean - centre, spread]) / side
        found[name] = Part(float(sums[0] / whole[0]), tuple(lies.tolist()))
    return found
