"""Whether a refined file is the source with its faces divided, and all else as it was.

That the children tile their parents is shown by whole numbers. That texture coordinates, colours
and materials are those of the source is shown by reading both files; what writes one is not asked.
"""

from __future__ import annotations

import numpy as np

from meshcone.assets import Asset, WritePolicy
from meshcone.certificate.checks import Check
from meshcone.certificate.division import DivisionRecord
from meshcone.certificate.rewriting import require_same_structure
from meshcone.errors import InputError
from meshcone.pair import Pair
from meshcone.report.report import Report
from meshcone.surface.arrays import Bools, Floats, Ints
from meshcone.surface.subdivision import Subdivision

# How far values may be apart that are stored as floats, or as text with eight decimals: of a
# value v as a share of the larger of 1 and |v|.
_ROUNDING = 2e-7
# What does not lie between values: directions are renewed from the surface, and the joints of
# several vertices are merged.
_NOT_COMPARED = ("NORMAL", "TANGENT", "JOINTS_", "WEIGHTS_")


def divide(
    pair: Pair, stored: DivisionRecord | None, report: Report, refined: bytes
) -> tuple[Pair, list[Check]]:
    """Divide the source as a certificate says.

    Args:
        pair: as sent, the source moved as aligned.
        stored: the record; None where no face was divided.
        report: which states how many were.
        refined: the refined file.

    Returns:
        The pair with its source divided, of which everything else is checked, and the checks.

    Raises:
        InputError, LimitError: the record is no division of the source, the source cannot be
            divided so, or the refined file cannot be read or is of another mesh.
    """
    told = report.detail
    if stored is None:
        if told is not None and (told.divided or told.faces_after != told.faces_before):
            raise InputError("the report states that faces were divided, the certificate does not")
        return pair, []
    subdivision = stored.checked(pair.source_asset.faces)
    counts = subdivision.sources, len(subdivision.parents), int(subdivision.divided.sum())
    if told is None or (told.faces_before, told.faces_after, told.divided) != counts:
        raise InputError("the report states other numbers of faces than the division has")
    divided = pair.divided(subdivision, report.options)
    written = divided.read_patched(refined)
    require_same_structure(divided, written)
    whole = subdivision.sources - np.count_nonzero(subdivision.divided)
    words = (
        f"{len(subdivision.parents) - whole:,} faces tile {subdivision.sources - whole:,} of the "
        f"{subdivision.sources:,} of the source, and those that share a side divide it alike: "
        "shown by whole numbers"
    )
    attributes = attributes_check(pair.source_asset, _unmoved(divided, written), subdivision)
    return divided, [Check("division", True, words), attributes]


def _unmoved(pair: Pair, written: Asset) -> Asset:
    """The refined file with its vertices back where those of the source are.

    Only there its polygons are sure to be split into the triangles that the source's are.
    """
    there = pair.source_asset
    if np.array_equal(written.triangles, there.triangles):
        return written
    used = written.weld >= 0
    vertices = written.vertices.copy()
    vertices[written.weld[used]] = there.positions[used]
    back = pair.read_patched(written.patched(vertices, WritePolicy(normals="keep")))
    if not np.array_equal(back.triangles, there.triangles):
        raise InputError("the refined file has other faces than the source")
    return back


def attributes_check(source: Asset, refined: Asset, subdivision: Subdivision) -> Check:
    """Compare each corner of a refined file with what lies there in the source.

    Texture coordinates, colours and materials are compared. The rest is covered where the line
    ``written`` says "byte for byte".

    Args:
        source: the file that was sent.
        refined: with the faces of the subdivision, in its order.
        subdivision: of the source's faces.
    """
    before, after = _Corners(source), _Corners(refined)
    rows, now = source.kept[subdivision.parents], refined.kept
    other = np.flatnonzero(after.materials[now] != before.materials[rows])
    if len(other):
        words = f"face {other[0]} of the refined file has another material than the one it lies in"
        return Check("attributes", False, words)
    names = sorted({*before.names, *after.names})
    compared = [name for name in names if not name.startswith(_NOT_COMPARED)]
    farthest = 0.0
    for name in compared:
        wanted = _between(before.values(name)[rows], subdivision)
        found = after.values(name)[now]
        if found.shape != wanted.shape:
            return Check("attributes", False, f"{name} has other components than in the source")
        off, wrong = _off(found, wanted, after.step(name) / 2)
        if wrong.any():
            face = int(np.argmax(wrong.any(axis=(1, 2))))
            words = f"{name} of face {face} of the refined file is {off[face].max():.3g} from what "
            return Check("attributes", False, words + "lies there in the source")
        farthest = max(farthest, float(off.max(initial=0.0)))
    words = f"{', '.join([*compared, 'materials'])}: what lies there in the source"
    words += f", to {farthest:.2g}" if compared else ""
    left = [name for name in names if name not in compared]
    return Check("attributes", True, words + (f"; {', '.join(left)}: not compared" if left else ""))


def _between(corners: Floats, subdivision: Subdivision) -> Floats:
    """(f, 3, c) values at the corners of children, of those (f, 3, c) at their parents'."""
    weights = subdivision.corners / 2.0**subdivision.exponent
    # A corner that has no part in it may have no value.
    terms = np.where(weights[..., None] > 0, weights[..., None] * corners[:, None], 0.0)
    return np.asarray(terms.sum(axis=2))


def _off(found: Floats, wanted: Floats, half_step: float) -> tuple[Floats, Bools]:
    """How far values are apart, infinitely where one is missing, and whether that is too far."""
    missing = np.isnan(found), np.isnan(wanted)
    off = np.where(missing[0] & missing[1], 0.0, np.abs(found - wanted))
    off[missing[0] ^ missing[1]] = np.inf
    return off, off > half_step + _ROUNDING * np.fmax(1.0, np.abs(wanted))


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

    def step(self, name: str) -> float:
        """The largest distance of neighbouring values, where they are stored as integers."""
        attributes = (draw.attributes.get(name) for draw in self._draws)
        return max((each.step for each in attributes if each is not None), default=0.0)
