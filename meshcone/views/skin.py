"""A picture of all colours of a surface, a patch for each triangle.

Whatever a file's colours come from (factors, textures in any wrapping, colours of vertices), and
however its triangles were made fewer, a viewer needs one image and where each triangle has its
colours in it. Patches are right triangles, two in a square whose side is a power of two: after
their sizes, the squares fill the image without a gap along a Z-order curve (Morton 1966).
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from meshcone.appearance.comparison import differences_at
from meshcone.appearance.paint import Paint, Spots, shown
from meshcone.srgb import to_encoded
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats, Ints

_SMALLEST, _LARGEST = 2, 8  # powers of two: sides of the squares, in texels
_UNKNOWN = 0.6  # linear grey of what has no known colour
_HALVINGS = 40
_QUALITY = 88


@dataclass(frozen=True)
class Skin:
    """The colours of a surface.

    Attributes:
        image: a JPEG file.
        side: its width and height in texels.
        corners: (m, 3, 2) the texel, column and row, in whose middle each corner of a face lies.
    """

    image: bytes
    side: int
    corners: NDArray[np.uint16]


@dataclass(frozen=True)
class Origin:
    """Where the triangles of a surface have their colours from.

    Attributes:
        paint: the colours of the asset.
        faces: (m,) the asset's face that each triangle is; None where they were made fewer.
        whole: all of the asset's surface.
    """

    paint: Paint
    faces: Ints | None
    whole: Mesh

    def spots(self, mesh: Mesh, spots: Floats) -> Spots:
        """Points of the mesh, a face and barycentric coordinates (k, 4), on the asset's faces."""
        rows, weights = spots[:, 0].astype(np.int64), spots[:, 1:]
        if self.faces is not None:
            return Spots(self.faces[rows], weights)
        points = np.einsum("kc,kcd->kd", weights, mesh.corners[rows])
        found = SurfaceTree(self.whole).closest(points)
        return Spots(found.faces, _barycentric(self.whole.corners[found.faces], found.points))


def skin_of(mesh: Mesh, origin: Origin, side: int) -> Skin:
    """Paint a surface.

    Args:
        mesh: with at most ``side²/8`` faces.
        origin: of its colours.
        side: of the picture in texels, a power of two.
    """
    patches = _patches(mesh.face_areas, side)
    spots = origin.spots(mesh, np.concatenate([patch.spots() for patch in patches]))
    pixels = np.zeros((side, side, 3), dtype=np.uint8)
    texels = np.concatenate([patch.texels() for patch in patches])
    pixels[texels[:, 1], texels[:, 0]] = _encoded(origin.paint.colours([spots])[0])
    return Skin(_jpeg(pixels), side, _corners(patches, len(mesh.faces)))


@dataclass(frozen=True)
class Contrast:
    """How different the colours of a surface are from those of another.

    Attributes:
        image: a PNG file of one channel, whose brightest value stands for ``top``.
        side: its width and height in texels.
        corners: (m, 3, 2) the texel, column and row, in whose middle each corner of a face lies.
        top: the largest CIEDE2000.
    """

    image: bytes
    side: int
    corners: NDArray[np.uint16]
    top: float


def contrast_of(
    mesh: Mesh, origin: Origin, theirs: tuple[Mesh, Paint], side: int
) -> Contrast | None:
    """Compare the colours of a surface with those of another, all over it.

    The smallest triangles have one value each, which is that of their middle.

    Args:
        mesh: with at most ``side²/8`` faces.
        origin: of its colours.
        theirs: the other surface, in the same frame, and its colours.
        side: of the picture in texels, a power of two.

    Returns:
        None where some colour is not known.
    """
    patches = _patches(mesh.face_areas, side)
    asked = [patch.middles() if patch.is_smallest else patch.spots() for patch in patches]
    spots = origin.spots(mesh, np.concatenate(asked))
    found = differences_at(spots, (origin.whole, origin.paint), theirs)
    if found is None:
        return None
    texels = [patch.texels() for patch in patches]
    each = [len(all_of) // max(len(some), 1) for all_of, some in zip(texels, asked, strict=True)]
    values = np.repeat(found, np.repeat(each, [len(some) for some in asked]))
    top = float(values.max(initial=0))
    pixels = np.zeros((side, side), dtype=np.uint8)
    columns, rows = np.concatenate(texels).T
    pixels[rows, columns] = np.rint(255 * values / top) if top > 0 else 0
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "PNG")
    return Contrast(out.getvalue(), side, _corners(patches, len(mesh.faces)), top)


def _patches(areas: Floats, side: int) -> list[_Patches]:
    """Room for each face, by its area (m,), in a picture."""
    powers = _powers(areas, side)
    order = np.argsort(-powers, kind="stable")
    patches = []
    begin = 0
    for power in np.unique(powers)[::-1]:
        faces = order[powers[order] == power]
        edge = 1 << int(power)
        squares = _squares((len(faces) + 1) // 2, begin, edge)
        begin += len(squares) * edge * edge
        for half in (0, 1):
            mine = faces[half::2]
            patches.append(_Patches(mine, squares[: len(mine)], edge, upper=half == 1))
    return patches


def _corners(patches: Sequence[_Patches], count: int) -> NDArray[np.uint16]:
    """(count, 3, 2) the texels of the corners of all faces."""
    corners = np.zeros((count, 3, 2), dtype=np.uint16)
    for patch in patches:
        corners[patch.faces] = patch.corners()
    return corners


def _powers(areas: Floats, side: int) -> Ints:
    """(m,) powers of two for the sides of squares, by area, so that all have room."""

    def fitted(scale: float) -> Ints:
        wanted = np.log2(np.maximum(scale * np.sqrt(areas), 1))
        return np.clip(np.round(wanted), _SMALLEST, _LARGEST).astype(np.int64)

    def taken(powers: Ints) -> int:
        counts = np.bincount(powers, minlength=_LARGEST + 1)
        return int(sum(((count + 1) // 2) << (2 * power) for power, count in enumerate(counts)))

    low, high = 0.0, side * 64 / max(float(np.sqrt(areas.max(initial=0.0))), 1e-300)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if taken(fitted(middle)) <= side * side else (low, middle)
    return fitted(low)


def _squares(count: int, begin: int, edge: int) -> Ints:
    """(count, 2) corners of squares along the Z-order curve, ``begin`` texels from its start."""
    along = begin + np.arange(count, dtype=np.int64) * edge * edge
    return np.stack([_even_bits(along), _even_bits(along >> 1)], axis=1)


def _even_bits(values: Ints) -> Ints:
    """Every other bit of numbers below 2³², the lowest first, put together."""
    bits = values & 0x55555555
    for shift, mask in ((1, 0x33333333), (2, 0x0F0F0F0F), (4, 0x00FF00FF), (8, 0x0000FFFF)):
        bits = (bits | (bits >> shift)) & mask
    return bits


@dataclass(frozen=True)
class _Patches:
    """Triangles of one size, in the lower or upper half of a square each.

    Attributes:
        faces: (k,) the triangles.
        squares: (k, 2) where their squares begin.
        edge: of the squares, in texels.
        upper: whether they have the half away from where the square begins.
    """

    faces: Ints
    squares: Ints
    edge: int
    upper: bool

    def _local(self) -> tuple[Ints, Floats]:
        """The half's texels (t, 2) in a square, and the barycentric coordinates (t, 3) there.

        Texels beyond the triangle, which filters read, have the colour of its nearest edge.
        """
        grid = np.stack(np.meshgrid(np.arange(self.edge), np.arange(self.edge)), axis=-1)
        texels = grid.reshape(-1, 2)
        texels = texels[(texels.sum(axis=1) >= self.edge - 1) == self.upper]
        legs = (texels - self._begin()) / self._leg()
        weights = np.column_stack([1 - legs.sum(axis=1), legs]).clip(0)
        return texels, weights / weights.sum(axis=1, keepdims=True)

    def _begin(self) -> int:
        return self.edge - 1 if self.upper else 0

    def _leg(self) -> int:
        return -(self.edge - 2) if self.upper else self.edge - 3

    def corners(self) -> Ints:
        """(k, 3, 2) the texels of the triangles' corners."""
        legs = np.array([[0, 0], [1, 0], [0, 1]]) * self._leg() + self._begin()
        return np.asarray(self.squares[:, None] + legs)

    def texels(self) -> Ints:
        """(k·t, 2) all texels of the patches."""
        texels, _ = self._local()
        return np.asarray((self.squares[:, None] + texels).reshape(-1, 2))

    @property
    def is_smallest(self) -> bool:
        return self.edge == 1 << _SMALLEST

    def middles(self) -> Floats:
        """(k, 4) for each triangle its number and its middle."""
        return np.column_stack([self.faces, np.full((len(self.faces), 3), 1 / 3)])

    def spots(self) -> Floats:
        """(k·t, 4) for each texel its face and barycentric coordinates."""
        _, weights = self._local()
        faces = np.repeat(self.faces, len(weights))
        return np.column_stack([faces, np.tile(weights, (len(self.faces), 1))])


def _barycentric(corners: Floats, points: Floats) -> Floats:
    """Coordinates (k, 3) of points (k, 3) in triangles (k, 3, 3); a flat one answers its middle."""
    along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    to = points - corners[:, 0]
    aa, ab, bb = (
        np.einsum("kd,kd->k", u, v) for u, v in ((along, along), (along, across), (across, across))
    )
    ta, tb = np.einsum("kd,kd->k", to, along), np.einsum("kd,kd->k", to, across)
    size = aa * bb - ab * ab
    flat = size <= 1e-12 * aa * bb
    second = np.where(flat, 1 / 3, (bb * ta - ab * tb) / np.where(flat, 1, size))
    third = np.where(flat, 1 / 3, (aa * tb - ab * ta) / np.where(flat, 1, size))
    weights = np.column_stack([1 - second - third, second, third]).clip(0)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _encoded(colours: Floats) -> NDArray[np.uint8]:
    """Linear RGBA (k, 4) as sRGB bytes (k, 3)."""
    opaque = np.where(np.isnan(colours[:, :1]), _UNKNOWN, shown(np.nan_to_num(colours)))
    encoded: NDArray[np.uint8] = np.rint(255 * to_encoded(opaque)).astype(np.uint8)
    return encoded


def _jpeg(pixels: NDArray[np.uint8]) -> bytes:
    out = io.BytesIO()
    # Colours in full resolution: in half of it, patches would take from their neighbours.
    Image.fromarray(pixels).save(out, "JPEG", quality=_QUALITY, subsampling=0)
    return out.getvalue()
