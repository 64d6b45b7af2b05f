"""What each mesh of a file has at its vertices, for a comparison with another file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from meshcone.assets import Asset
from meshcone.assets.content import Attribute, Content, Draw, first_uses, placed
from meshcone.auditing.field import Field, FieldSum, Shares, kind_of
from meshcone.srgb import to_encoded
from meshcone.surface.arrays import Floats, Ints, normalized, row_dot

_AT_ONCE = 100_000  # triangles
_SKINS = ("JOINTS_", "WEIGHTS_")  # which bindings are about
_COORDINATES = "TEXCOORD_"


class Fields:
    """The attributes and morph targets of the meshes of a file.

    Args:
        asset: whose positions count, as they are read.
        content: of the same file.
        meshes: what its meshes are called.
        moved: (4, 4) what its positions are moved by before they are compared, if by anything.
    """

    def __init__(
        self,
        asset: Asset,
        content: Content,
        meshes: Sequence[str],
        moved: Floats | None = None,
    ) -> None:
        self._asset = asset
        self._moved = np.eye(4) if moved is None else moved
        self._textures = [first_uses(material) for material in content.materials]
        self._draws: dict[str, list[Draw]] = {}
        self._kept: tuple[str, dict[tuple[int, int, bool], Shares]] = ("", {})
        seen: set[tuple[int, int]] = set()
        for draw in content.draws:
            if (draw.mesh, draw.primitive) not in seen:
                seen.add((draw.mesh, draw.primitive))
                self._draws.setdefault(meshes[draw.mesh], []).append(draw)

    def differing(
        self, other: Fields, here: tuple[str, str], there: tuple[str, str]
    ) -> tuple[Field | None, Field | None] | None:
        """The first values of two that differ; None where none do that are drawn in both files.

        Values of which nothing is known in one file alone, because they cannot be read, differ.

        Args:
            other: those of the other file.
            here: mesh and attribute, or morph target, of this one.
            there: the same of the other one.
        """
        if here[0] not in self._draws or there[0] not in other._draws:
            return None
        for suffix in self._suffixes(*here):
            first: tuple[Field | None, Field | None] | None = None
            # Where a mesh is drawn first may differ, and so may the units it is stored in;
            # coordinates have units of their own, which a transform of the texture undoes.
            reads = (True, False) if here[1].startswith(_COORDINATES) else (False,)
            for read, stored in product(reads, (False, True)):
                one = self._field(here[0], here[1] + suffix, stored=stored, read=read)
                two = other._field(there[0], there[1] + suffix, stored=stored, read=read)
                alike = one is two if one is None or two is None else one.is_like(two)
                if alike:
                    first = None
                    break
                first = first or (one, two)
            if first is not None:
                return first
        return None

    def _suffixes(self, mesh: str, name: str) -> list[str]:
        """What follows a name: a morph target may add to several things."""
        if name.startswith(_SKINS):
            return []
        draws = self._draws.get(mesh, [])
        found = {each: None for draw in draws for each in (*draw.attributes, *draw.others)}
        return [each[len(name) :] for each in found if each == name or each.startswith(f"{name} ")]

    def _field(self, mesh: str, name: str, *, stored: bool, read: bool) -> Field | None:
        """An attribute as the mesh is drawn first, or as it is stored; None where none is known.

        Coordinates are as they are stored, or as a texture is read through them.
        """
        total = FieldSum(kind_of(name))
        for draw in self._draws.get(mesh, []):
            attribute = draw.attributes.get(name) or draw.others.get(name)
            if attribute is None:
                continue
            turn = (np.eye(4) if stored else self._moved @ draw.matrix)[:3, :3]
            shares = self._shares(mesh, draw, attribute.corners, stored=stored)
            values = attribute.read(shares.rows)
            if not np.isfinite(values).all():
                whole = float(shares.area.sum())
                shares = self._of_numbers(draw, attribute, values, shares.rows, stored=stored)
                total.lack(max(whole - float(shares.area.sum()), 0.0))
                values = attribute.read(shares.rows)
            turned = None
            if name == "TANGENT" and values.shape[1] > 3:
                turned = (values[:, 3] * np.linalg.det(turn) < 0).astype(np.float64)
            found = _read(name, values, turn)
            total.add(shares, self._placed(draw, name, found) if read else found, turned)
            if name == "NORMAL":
                self._lean(total, draw, attribute)
        return total.total()

    def _placed(self, draw: Draw, name: str, values: Floats) -> Floats:
        textures = {} if draw.material is None else self._textures[draw.material]
        uses = {f"{_COORDINATES}{number}": use for number, use in textures.items()}
        return placed(uses[name], values) if name in uses else values

    def _shares(self, mesh: str, draw: Draw, corners: Ints, *, stored: bool) -> Shares:
        """Shares are the same for all attributes of a glTF's draw; those of one mesh are kept."""
        if self._kept[0] != mesh:
            self._kept = mesh, {}
        key = id(draw), id(corners), stored
        if key not in self._kept[1]:
            places = self._places(draw, slice(None), stored=stored)
            self._kept[1][key] = Shares.of(corners, places)
        return self._kept[1][key]

    def _of_numbers(
        self, draw: Draw, attribute: Attribute, values: Floats, rows: Ints, *, stored: bool
    ) -> Shares:
        """Shares of triangles all of whose corners have numbers."""
        good = np.zeros(int(rows.max(initial=-1)) + 2, dtype=bool)  # the last stands for none
        good[rows] = np.isfinite(values).all(axis=1)
        whole = np.flatnonzero(good[attribute.corners].all(axis=1))
        return Shares.of(attribute.corners[whole], self._places(draw, whole, stored=stored))

    def _places(self, draw: Draw, some: slice | Ints, *, stored: bool) -> Floats:
        """(k, 3, 3) corners of some triangles of a draw, where they are compared."""
        corners = self._asset.positions[self._asset.triangles[draw.rows[some]]]
        brought = _inverse(draw.matrix) if stored else self._moved
        placed = corners @ brought[:3, :3].T + brought[:3, 3]
        return np.asarray(placed - self._origin(draw, brought))

    def _origin(self, draw: Draw, brought: Floats) -> Floats:
        """A place near the mesh, so that squares of places are no larger than they have to be."""
        first = self._draws[self._kept[0]][0] if self._kept[0] in self._draws else draw
        place = self._asset.positions[self._asset.triangles[first.rows[:1], 0]]
        if not len(place) or not np.isfinite(place).all():
            return np.zeros(3)
        return np.asarray(place[0] @ brought[:3, :3].T + brought[:3, 3])

    def _lean(self, total: FieldSum, draw: Draw, attribute: Attribute) -> None:
        covector = _covector(draw.matrix[:3, :3])
        for start in range(0, len(draw.rows), _AT_ONCE):
            some = slice(start, start + _AT_ONCE)
            values = replace(attribute, corners=attribute.corners[some]).at_corners()
            corners = self._asset.positions[self._asset.triangles[draw.rows[some]]]
            sides = corners[:, 1:] - corners[:, :1]
            crossed = np.cross(sides[:, 0], sides[:, 1])
            mean = normalized(normalized(values @ covector.T).sum(axis=1))
            cosines = np.clip(row_dot(mean, normalized(crossed)), -1, 1)
            total.lean(np.degrees(np.arccos(cosines)), np.linalg.norm(crossed, axis=1))


def _inverse(matrix: Floats) -> Floats:
    """What brings (4, 4) a mesh back to where it is stored; nothing, where it was flattened."""
    try:
        return np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.eye(4)


def _read(name: str, values: Floats, turn: Floats) -> Floats:
    """Values as they are compared: directions turned, colours as they are seen."""
    turns: tuple[tuple[str, Callable[[Floats], Floats]], ...] = (
        ("COLOR_", _shown),
        (_COORDINATES, lambda found: found[..., :2]),
        ("NORMAL", lambda found: normalized(found @ _covector(turn).T)),
        ("TANGENT", lambda found: normalized(found[..., :3] @ turn.T)),
        # Lengths are as large as the mesh; what is added to directions is turned alone.
        ("target ", lambda found: found @ (turn if name.count(" ") == 1 else _turn_of(turn)).T),
    )
    found = next((read for prefix, read in turns if name.startswith(prefix)), None)
    return values if found is None else found(values)


def _shown(colors: Floats) -> Floats:
    """RGBA (r, 4) as encoded, where differences are as large as they look."""
    opaque = np.ones((len(colors), max(4 - colors.shape[1], 0)))
    return np.concatenate([to_encoded(colors[:, :3]), colors[:, 3:4], opaque], axis=1)


def _covector(linear: Floats) -> Floats:
    """What turns normals where (3, 3) turns places: it exists where that flattens, too.

    Where it mirrors, triangles have been turned around.
    """
    columns = [np.cross(linear[:, (i + 1) % 3], linear[:, (i + 2) % 3]) for i in range(3)]
    return np.asarray(np.stack(columns, axis=1) * (np.sign(np.linalg.det(linear)) or 1.0))


def _turn_of(linear: Floats) -> Floats:
    """A (3, 3) matrix but for the size it brings things to."""
    size = float(np.cbrt(abs(np.linalg.det(linear))))
    return np.asarray(linear / size) if size > 0 else np.eye(3)
