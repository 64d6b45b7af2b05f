"""The texture coordinates of an asset, per set and material."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from meshcone.assets.pictures import Picture
from meshcone.auditing.coverage import coverage, texels_in_boxes
from meshcone.auditing.records.uv import Uv, UvSet
from meshcone.auditing.subject import UV_SETS_READ, Seen, Subject
from meshcone.surface.arrays import Bools, Floats

RESOLUTION = 1024
"""Texels along a side, at which overlap, unused share and gutters are found."""

_SMALLEST_RESOLUTION = 64
_MOST_CENTRES = 20_000_000  # of all sets and materials together, about 40 ns each
_ROUNDING = 1e-6  # beyond 0 and 1, as exporters round
_FLAT = 1e-9  # area by longest side squared
_WIDEST_GUTTER = 64  # texels


def uv_of(subject: Subject, pictures: tuple[Picture, ...]) -> Uv:
    """Look at every set of every material."""
    charts = list(_charts(subject, pictures))
    centres = _MOST_CENTRES // max(len(charts), 1)
    found = tuple(_inspect(chart, centres, subject.seen) for chart in charts)
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
        uv: (k, 3, 2) coordinates; NaN where there are none.
        has: (k,) whether the file has the set there at all.
        areas: (k,) in model units squared.
        solid: (k,) whether they have an area.
        textured: whether a texture is read through the set.
        texels: its width and height, if they could be read.
    """

    number: int
    material: str
    uv: Floats
    has: Bools
    areas: Floats
    solid: Bools
    textured: bool
    texels: tuple[int, int] | None


def _charts(subject: Subject, pictures: tuple[Picture, ...]) -> Iterator[_Chart]:
    content = subject.content
    by_material: dict[int | None, list[int]] = {}
    for number, draw in enumerate(content.draws):
        by_material.setdefault(draw.material, []).append(number)
    for material, numbers in by_material.items():
        draws = [content.draws[number] for number in numbers]
        uses = [] if material is None else content.materials[material].textures
        textures = {use.uv_set: use for use in reversed(uses)}  # the first of a set counts
        sets = {
            number
            for number in range(UV_SETS_READ)
            if number in textures or any(f"TEXCOORD_{number}" in draw.attributes for draw in draws)
        }
        rows = np.concatenate([draw.rows for draw in draws])
        for number in sorted(sets):
            corners = [subject.corners(draw, f"TEXCOORD_{number}") for draw in draws]
            has = [np.full(len(d.rows), c is not None) for d, c in zip(draws, corners, strict=True)]
            uv = [
                np.full((len(draw.rows), 3, 2), np.nan) if found is None else found[..., :2]
                for draw, found in zip(draws, corners, strict=True)
            ]
            use = textures.get(number)
            picture = pictures[use.image] if use and use.image is not None else None
            size = (picture.width, picture.height) if picture else (None, None)
            yield _Chart(
                number=number,
                material="" if material is None else content.materials[material].name,
                uv=np.concatenate(uv),
                has=np.concatenate(has),
                areas=subject.listed.face_areas[rows],
                solid=subject.solid[rows],
                textured=use is not None,
                texels=(size[0], size[1]) if size[0] and size[1] else None,
            )


def _inspect(chart: _Chart, centres: int, seen: Seen) -> UvSet:
    given = chart.has & ~np.isnan(chart.uv).all(axis=(1, 2))
    finite = np.isfinite(chart.uv).all(axis=(1, 2))
    uv, areas, solid = chart.uv[finite], chart.areas[finite], chart.solid[finite]
    first, second = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    with np.errstate(over="ignore", invalid="ignore"):
        signed = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
        sides = np.stack([first, second, second - first], axis=1)
        longest = (sides * sides).sum(axis=2).max(axis=1, initial=0.0)
        flat = ~(np.abs(signed) > _FLAT * longest)
    proper = solid & ~flat & np.isfinite(signed)
    forward = float(areas[proper & (signed > 0)].sum())
    backward = float(areas[proper & (signed < 0)].sum())
    low, median, high = _densities(chart, areas[proper], np.abs(signed[proper]))
    drawn = uv[proper]
    content = ("raster", hashlib.sha256(drawn.tobytes()).digest(), centres)
    raster = seen.once(content, lambda: _Raster.of(drawn, centres))
    spans = np.ptp(uv, axis=1).max(axis=1, initial=0.0) if len(uv) else np.zeros(0)
    outside = ((uv < -_ROUNDING) | (uv > 1 + _ROUNDING)).any(axis=(1, 2))
    return UvSet(
        set=chart.number,
        material=chart.material,
        triangles=len(chart.uv),
        missing=int(np.count_nonzero(~given)),
        not_finite=int(np.count_nonzero(given & ~finite)),
        degenerate=int(np.count_nonzero(solid & flat)),
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


def _densities(
    chart: _Chart, areas: Floats, uv_areas: Floats
) -> tuple[float | None, float | None, float | None]:
    """5th percentile, median and 95th percentile by area, in texels per model unit."""
    if chart.texels is None or len(areas) == 0:
        return None, None, None
    width, height = chart.texels
    density = np.sqrt(uv_areas * width * height / areas)
    order = np.argsort(density)
    shares = np.cumsum(areas[order]) / areas.sum()
    places = np.minimum(np.searchsorted(shares, (0.05, 0.5, 0.95)), len(order) - 1)
    low, median, high = density[order][places].tolist()
    return low, median, high


@dataclass(frozen=True)
class _Raster:
    """What drawing a chart says."""

    size: int
    overlap: float
    unused: float
    gutter: int

    @staticmethod
    def of(uv: Floats, centres: int) -> _Raster | None:
        """Draw triangles; None where none is left or they repeat too often.

        Args:
            uv: (m, 3, 2) coordinates.
            centres: of texels that may be tested.
        """
        size = RESOLUTION
        while size >= _SMALLEST_RESOLUTION and texels_in_boxes(uv, size) > centres:
            size //= 2
        if len(uv) == 0 or size < _SMALLEST_RESOLUTION:
            return None
        counts = coverage(uv, size)
        used = int(np.count_nonzero(counts))
        return _Raster(
            size=size,
            overlap=int(np.count_nonzero(counts > 1)) / max(used, 1),
            unused=1 - used / counts.size,
            gutter=_gutter(counts > 0),
        )


def _gutter(covered: Bools) -> int:
    """Texels between the two islands that are closest, up to 64.

    Islands are what covers texels that touch. Where there is one alone, or two are farther
    apart than 64 texels, the answer is 64.
    """
    labels, islands = ndimage.label(covered, structure=np.ones((3, 3)))
    if islands < 2:
        return _WIDEST_GUTTER
    nearest = ndimage.distance_transform_cdt(
        ~covered, metric="chessboard", return_distances=True, return_indices=True
    )
    distances, indices = nearest
    owner = labels[tuple(indices)]
    narrowest = _WIDEST_GUTTER
    # Two islands are closest where the texels nearest to either meet.
    for axis in (0, 1):
        here, there = [slice(None)] * 2, [slice(None)] * 2
        here[axis], there[axis] = slice(None, -1), slice(1, None)
        borders = owner[tuple(here)] != owner[tuple(there)]
        if borders.any():
            between = (distances[tuple(here)] + distances[tuple(there)])[borders]
            narrowest = min(narrowest, int(between.min()))
    return narrowest


def _worst(values: Iterator[float | None]) -> float | None:
    found = list(values)
    known = [value for value in found if value is not None]
    return None if len(known) < len(found) else max(known, default=0.0)


def _narrowest(found: tuple[UvSet, ...]) -> int | None:
    known = [each.gutter for each in found if each.gutter is not None]
    # What could not be drawn may be narrower than the rest.
    return None if len(known) < len(found) else min(known, default=_WIDEST_GUTTER)
