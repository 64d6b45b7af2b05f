"""The texture coordinates of an asset, per set and material."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from meshcone.assets.content import Draw, TextureUse, first_uses, placed
from meshcone.assets.pictures import Picture
from meshcone.auditing.raster import WIDEST_GUTTER, Raster, resolutions
from meshcone.auditing.records.uv import Uv, UvSet
from meshcone.auditing.subject import UV_SETS_READ, Seen, Subject
from meshcone.surface.arrays import Bools, Floats

_ROUNDING = 1e-6  # beyond 0 and 1, as exporters round
_FLAT = 1e-9  # area by longest side squared


def uv_of(subject: Subject, pictures: tuple[Picture, ...]) -> Uv:
    """Look at every set of every material."""
    charts = list(_charts(subject, pictures))
    sizes = resolutions([chart.drawn for chart in charts])
    found = tuple(
        _inspect(chart, _raster(chart.drawn, size, subject.seen))
        for chart, size in zip(charts, sizes, strict=True)
    )
    medians = (each.texel_density_median for each in found)
    densities = [each for each in medians if each is not None]
    if any(chart.texels is None and chart.textured for chart in charts):
        densities = []  # a texture whose size is not known could be the one that matters
    return Uv(
        sets=len(found),
        missing=sum(each.missing for each in found),
        not_finite=sum(each.not_finite for each in found),
        degenerate=sum(each.degenerate for each in found),
        outside=sum(each.outside for each in found),
        tiles=any(each.tiles for each in found),
        overlap_share=_worst(each.overlap_share for each in found),
        inverted_share=max((each.inverted_share for each in found), default=0.0),
        unused_share=_worst(each.unused_share for each in found),
        texel_density_min=min(densities, default=None),
        texel_density_max=max(densities, default=None),
        gutter=_narrowest(found),
        by_material=found,
    )


@dataclass(frozen=True)
class _Chart:
    """Triangles with one material, and one set of their coordinates.

    Attributes:
        uv: (k, 3, 2) coordinates, as the first texture is read through them; NaN where there are
            none.
        has: (k,) whether the file has the set there at all, be it no numbers.
        areas: (k,) in model units squared.
        solid: (k,) whether they have an area.
        first: (k,) whether they are what the file stores, and no further copy of it at another
            node.
        turned: (k,) whether a node that mirrors has turned them around.
        textured: whether a texture is read through the set.
        texels: its width and height, if they could be read.
    """

    number: int
    material: str
    uv: Floats
    has: Bools
    areas: Floats
    solid: Bools
    first: Bools
    turned: Bools
    textured: bool
    texels: tuple[int, int] | None

    @cached_property
    def finite(self) -> Bools:
        """(k,) whether all coordinates are numbers."""
        return np.asarray(np.isfinite(self.uv).all(axis=(1, 2)))

    @cached_property
    def signed(self) -> Floats:
        """(k,) areas in the texture, negative where the mesh as stored runs clockwise."""
        first, second = self.uv[:, 1] - self.uv[:, 0], self.uv[:, 2] - self.uv[:, 0]
        with np.errstate(over="ignore", invalid="ignore"):
            doubled = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        return np.asarray(np.where(self.turned, -doubled, doubled) / 2)

    @cached_property
    def flat(self) -> Bools:
        """(k,) whether they have coordinates, and no area in the texture."""
        sides = np.roll(self.uv, -1, axis=1) - self.uv
        with np.errstate(over="ignore", invalid="ignore"):
            longest = (sides * sides).sum(axis=2).max(axis=1, initial=0.0)
            return np.asarray(self.finite & ~(np.abs(self.signed) > _FLAT * longest))

    @cached_property
    def proper(self) -> Bools:
        """(k,) whether they have an area, on the surface and in the texture."""
        return np.asarray(self.finite & self.solid & ~self.flat & np.isfinite(self.signed))

    @cached_property
    def drawn(self) -> Floats:
        """(m, 3, 2) coordinates of those with an area, each once however many nodes place it."""
        return np.asarray(self.uv[self.proper & self.first])


def _charts(subject: Subject, pictures: tuple[Picture, ...]) -> Iterator[_Chart]:
    content = subject.content
    by_material: dict[int | None, list[Draw]] = {}
    for draw in content.draws:
        by_material.setdefault(draw.material, []).append(draw)
    for material, draws in by_material.items():
        textures = {} if material is None else first_uses(content.materials[material])
        stored = {
            number
            for number in range(UV_SETS_READ)
            if any(f"TEXCOORD_{number}" in draw.attributes for draw in draws)
        }
        rows = np.concatenate([draw.rows for draw in draws])
        first = _by_triangle(draws, _firsts(draws))
        turned = _by_triangle(draws, [draw.mirrored for draw in draws])
        for number in sorted(stored | textures.keys()):
            corners = [subject.corners(draw, f"TEXCOORD_{number}") for draw in draws]
            uv = [
                np.full((len(draw.rows), 3, 2), np.nan) if found is None else found[..., :2]
                for draw, found in zip(draws, corners, strict=True)
            ]
            use = textures.get(number)
            yield _Chart(
                number=number,
                material="" if material is None else content.materials[material].name,
                uv=np.concatenate(uv) if use is None else placed(use, np.concatenate(uv)),
                has=np.concatenate([_has(draw, f"TEXCOORD_{number}") for draw in draws]),
                areas=subject.listed.face_areas[rows],
                solid=subject.solid[rows],
                first=first,
                turned=turned,
                textured=use is not None,
                texels=_texels(use, pictures),
            )


def _has(draw: Draw, name: str) -> Bools:
    """(k,) which triangles of a draw have an attribute at some corner."""
    attribute = draw.attributes.get(name)
    if attribute is None:
        return np.zeros(len(draw.rows), dtype=bool)
    return np.asarray((attribute.corners >= 0).any(axis=1))


def _firsts(draws: list[Draw]) -> list[bool]:
    """Which draws are the first of their primitive."""
    seen: set[tuple[int, int]] = set()
    found = []
    for draw in draws:
        found.append((draw.mesh, draw.primitive) not in seen)
        seen.add((draw.mesh, draw.primitive))
    return found


def _by_triangle(draws: list[Draw], values: list[bool]) -> Bools:
    """(k,) what is so of each draw, for each of its triangles."""
    return np.repeat(np.array(values, dtype=bool), [len(draw.rows) for draw in draws])


def _texels(use: TextureUse | None, pictures: tuple[Picture, ...]) -> tuple[int, int] | None:
    picture = pictures[use.image] if use and use.image is not None else None
    if picture is None or not (picture.width and picture.height):
        return None
    return picture.width, picture.height


def _raster(drawn: Floats, size: int | None, seen: Seen) -> Raster | None:
    if size is None:
        return None
    content = ("raster", hashlib.sha256(drawn.tobytes()).digest(), size)
    return seen.once(content, partial(Raster.of, drawn, size))


def _inspect(chart: _Chart, raster: Raster | None) -> UvSet:
    uv, areas, signed = chart.uv[chart.finite], chart.areas, chart.signed
    forward = float(areas[chart.proper & (signed > 0)].sum())
    backward = float(areas[chart.proper & (signed < 0)].sum())
    low, median, high = _densities(chart)
    spans = np.ptp(uv, axis=1).max(axis=1, initial=0.0) if len(uv) else np.zeros(0)
    outside = ((uv < -_ROUNDING) | (uv > 1 + _ROUNDING)).any(axis=(1, 2))
    return UvSet(
        set=chart.number,
        material=chart.material,
        triangles=len(chart.uv),
        missing=int(np.count_nonzero(~chart.has)) if chart.textured else 0,
        not_finite=int(np.count_nonzero(chart.has & ~chart.finite)),
        degenerate=int(np.count_nonzero(chart.solid & chart.flat)),
        outside=int(np.count_nonzero(outside)),
        tiles=bool((spans > 1 + _ROUNDING).any()),
        overlap_share=raster.overlap if raster else None,
        inverted_share=min(forward, backward) / ((forward + backward) or 1.0),
        unused_share=raster.unused if raster else None,
        texel_density_median=median,
        texel_density_p5=low,
        texel_density_p95=high,
        gutter=raster.gutter if raster else None,
        resolution=raster.size if raster else None,
    )


def _densities(chart: _Chart) -> tuple[float | None, float | None, float | None]:
    """5th percentile, median and 95th percentile by area, in texels per model unit."""
    areas, uv_areas = chart.areas[chart.proper], np.abs(chart.signed[chart.proper])
    if chart.texels is None or len(areas) == 0:
        return None, None, None
    width, height = chart.texels
    density = np.sqrt(uv_areas) / np.sqrt(areas) * np.sqrt(width * height)
    order = np.argsort(density)
    shares = np.cumsum(areas[order]) / areas.sum()
    places = np.minimum(np.searchsorted(shares, (0.05, 0.5, 0.95)), len(order) - 1)
    low, median, high = density[order][places].tolist()
    return low, median, high


def _worst(values: Iterator[float | None]) -> float | None:
    found = list(values)
    known = [value for value in found if value is not None]
    return None if len(known) < len(found) else max(known, default=0.0)


def _narrowest(found: tuple[UvSet, ...]) -> int | None:
    known = [each.gutter for each in found if each.gutter is not None]
    # What could not be drawn may be narrower than the rest.
    return None if len(known) < len(found) else min(known, default=WIDEST_GUTTER)
