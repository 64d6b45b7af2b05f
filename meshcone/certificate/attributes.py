"""Whether what a divided source has at its corners is what lies there in the source.

Both files are read; what writes one is not asked.
"""

from __future__ import annotations

import numpy as np

from meshcone.assets import Asset
from meshcone.certificate.checks import Check
from meshcone.surface.arrays import Bools, Floats, Ints
from meshcone.surface.subdivision import Subdivision

# How far values may be apart that are stored as floats, or as text with eight decimals: of a
# value v as a share of the larger of 1 and |v|.
_ROUNDING = 2e-7
# Directions lie between nothing: they are renewed from the surface.
_DIRECTIONS = ("NORMAL", "TANGENT")
_JOINTS, _WEIGHTS = "JOINTS_", "WEIGHTS_"
_SUMMED = 1e-6  # rounding of weights that are merged, and divided by what they add up to


def attributes_check(source: Asset, refined: Asset, subdivision: Subdivision) -> Check:
    """Compare each corner of a refined file with what lies there in the source.

    Texture coordinates, colours, skin weights and materials are compared. The rest is covered
    where the line ``written`` says "byte for byte".

    Args:
        source: the file that was sent.
        refined: with the triangles of the source divided, each where it stood.
        subdivision: of the source's faces.
    """
    both = _Both(source, refined, subdivision)
    other = np.flatnonzero((both.materials[0] != both.materials[1]).any(axis=1))
    if len(other):
        words = f"face {other[0]} of the refined file has another material than the one it lies in"
        return Check("attributes", False, words)
    skinned = [name for name in both.names if name.startswith((_JOINTS, _WEIGHTS))]
    renewed = [name for name in both.names if name.startswith(_DIRECTIONS)]
    compared = [name for name in both.names if name not in (*skinned, *renewed)]
    farthest = 0.0
    for name in compared:
        wanted, found = both.values(name)
        if found.shape != wanted.shape:
            return Check("attributes", False, f"{name} has other components than in the source")
        off, wrong = _off(found, wanted, both.step(name) / 2)
        if wrong.any():
            return _wrong(name, off, np.asarray(wrong.any(axis=2)))
        farthest = max(farthest, float(off.max(initial=0.0)))
    words = f"{', '.join([*compared, 'materials'])}: what lies there in the source"
    words += f", to {farthest:.2g}" if compared else ""
    if skinned:
        off, lost = both.skins(sorted({name.rpartition("_")[2] for name in skinned}))
        wrong = np.asarray(off > 4 * len(skinned) * both.step("WEIGHTS_0") + _SUMMED)
        if wrong.any():
            return _wrong("the skin", off, wrong)
        words += f"; skins: the joints around, but for {lost.max(initial=0.0):.2g} of their weight"
    words += f"; {', '.join(renewed)}: not compared" if renewed else ""
    return Check("attributes", True, words)


def _divided_rows(source: Asset, subdivision: Subdivision) -> Ints:
    """(f,) which triangle of the divided file each child is.

    Triangles of a divided file stand in the order of those they lie in. One whose corners have
    come to lie at one place, such as where a vertex is on the side of another face, is no
    face of it, but is still listed.
    """
    counts = np.ones(len(source.triangles), dtype=np.int64)
    counts[source.kept] = np.bincount(subdivision.parents, minlength=len(source.faces))
    starts = np.cumsum(counts) - counts
    first = np.searchsorted(subdivision.parents, subdivision.parents)
    rank = np.arange(len(subdivision.parents)) - first
    return np.asarray(starts[source.kept[subdivision.parents]] + rank, dtype=np.int64)


def _wrong(name: str, off: Floats, wrong: Bools) -> Check:
    """Name the first face (f, 3) a corner of which is wrong, and how far off it is."""
    face = int(np.argmax(wrong.any(axis=1)))
    words = f"{name} of face {face} of the refined file is {off[face].max():.3g} from what lies "
    return Check("attributes", False, words + "there in the source")


def _off(found: Floats, wanted: Floats, half_step: float) -> tuple[Floats, Bools]:
    """How far values are apart, infinitely where one is missing, and whether that is too far."""
    missing = np.isnan(found), np.isnan(wanted)
    off = np.where(missing[0] & missing[1], 0.0, np.abs(found - wanted))
    off[missing[0] ^ missing[1]] = np.inf
    return off, off > half_step + _ROUNDING * np.fmax(1.0, np.abs(wanted))


class _Both:
    """What source and refined file have at each corner of the refined file."""

    def __init__(self, source: Asset, refined: Asset, subdivision: Subdivision) -> None:
        self._before, self._after = _Corners(source), _Corners(refined)
        self._rows = source.kept[subdivision.owners]
        self._now = _divided_rows(source, subdivision)
        self._weights = subdivision.places / 2.0**subdivision.exponent
        self.names = sorted({*self._before.names, *self._after.names})

    @property
    def materials(self) -> tuple[Ints, Ints]:
        """(f, 3) material where each corner lies, and of the face itself; −1 for the default."""
        now = self._after.materials[self._now]
        return self._before.materials[self._rows], np.repeat(now[:, None], 3, axis=1)

    def values(self, name: str) -> tuple[Floats, Floats]:
        """(f, 3, c) what lies at each corner in the source, and what the refined file has there."""
        corners = self._before.values(name)[self._rows]
        # A corner that has no part in it may have no value.
        weights = self._weights[..., None]
        terms = np.where(weights > 0, weights * corners, 0.0)
        return terms.sum(axis=2), self._after.values(name)[self._now]

    def step(self, name: str) -> float:
        """The distance of neighbouring values in the refined file, 0 for floats."""
        return self._after.step(name)

    def skins(self, sets: list[str]) -> tuple[Floats, Floats]:
        """How far (f, 3) the joints of each corner are from the heaviest of those around it.

        Args:
            sets: their numbers: 0, and 1 where a vertex may follow more than four joints.

        Returns:
            The sum over all joints of differences of weights, those of a corner taken as shares of
            their sum; and the share of those around it that there is no room for.
        """
        (joints, weights), now = (
            tuple(each.table(prefix, sets)[rows] for prefix in (_JOINTS, _WEIGHTS))
            for each, rows in ((self._before, self._rows), (self._after, self._now))
        )
        shape = (*weights.shape[:2], -1)
        blended = (self._weights[..., None] * weights).reshape(shape)
        around, blended = _merged(joints.reshape(shape), _as_shares(blended))
        room = weights.shape[3]
        order = np.argsort(-blended, axis=2, kind="stable")
        around, blended = (np.take_along_axis(each, order, axis=2) for each in (around, blended))
        kept = _as_shares(blended[..., :room])
        joints = np.concatenate([around[..., :room], now[0]], axis=2)
        weights = np.concatenate([kept, -_as_shares(now[1])], axis=2)
        off = np.abs(_merged(joints, weights)[1]).sum(axis=2)
        # Of joints that weigh the same at the limit, either may have been left out.
        limit = blended[..., room - 1] - blended[..., room] <= _SUMMED
        tied = np.where(limit, 2 * blended[..., room], 0.0)
        return np.maximum(off - 2 * tied, 0.0), blended[..., room:].sum(axis=2)


def _as_shares(weights: Floats) -> Floats:
    """(f, 3, s) weights, divided by what those of a corner add up to."""
    total = weights.sum(axis=2, keepdims=True)
    return np.asarray(weights / np.where(total > 0, total, 1.0))


def _merged(joints: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Joints (f, 3, s) in order, all of a joint's weight where it stands last."""
    order = np.argsort(joints, axis=2, kind="stable")
    joints = np.take_along_axis(joints, order, axis=2)
    weights = np.take_along_axis(weights, order, axis=2)
    for slot in range(1, joints.shape[2]):
        same = joints[..., slot] == joints[..., slot - 1]
        weights[..., slot] += np.where(same, weights[..., slot - 1], 0.0)
        weights[..., slot - 1] = np.where(same, 0.0, weights[..., slot - 1])
    return joints, weights


class _Corners:
    """What the triangles of a file have at their corners."""

    def __init__(self, asset: Asset) -> None:
        self._count = len(asset.triangles)
        self._draws = asset.content().draws
        self.names = {name for draw in self._draws for name in draw.attributes}

    @property
    def materials(self) -> Ints:
        """(k,) index of each triangle's material, −1 for the default."""
        found = np.full(self._count, -1, dtype=np.int64)
        for draw in self._draws:
            found[draw.rows] = -1 if draw.material is None else draw.material
        return found

    def values(self, name: str) -> Floats:
        """(k, 3, c) values of an attribute as the file states them; NaN where it has none."""
        read = [
            (draw.rows, draw.attributes[name].at_corners(as_stored=True))
            for draw in self._draws
            if name in draw.attributes
        ]
        columns = max((values.shape[2] for _, values in read), default=0)
        found = np.full((self._count, 3, columns), np.nan)
        for rows, values in read:
            found[rows, :, : values.shape[2]] = values
        return found

    def table(self, prefix: str, sets: list[str]) -> Floats:
        """(k, 3, 4 sets) joints or weights of all sets; 0 where there are none."""
        found = np.zeros((self._count, 3, 4 * len(sets)))
        for place, each in enumerate(sets):
            values = np.nan_to_num(self.values(prefix + each))[..., :4]
            found[..., 4 * place : 4 * place + values.shape[2]] = values
        return found

    def step(self, name: str) -> float:
        """The largest distance of neighbouring values, where they are stored as integers."""
        attributes = (draw.attributes.get(name) for draw in self._draws)
        return max((each.step for each in attributes if each is not None), default=0.0)
