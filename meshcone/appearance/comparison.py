"""Comparing the colours of surfaces at closest points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from meshcone.appearance.ciede2000 import differences, to_lab
from meshcone.appearance.facing import FacingSurface
from meshcone.appearance.paint import Paint, Spots, shown
from meshcone.appearance.records import Appearance, ColorDifference, Compared
from meshcone.quality.sampled import SampledSurface
from meshcone.srgb import to_encoded
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats, Ints, row_dot
from meshcone.surface.closest import barycentric_weights

_LEAST_ERROR = 10**-9.9  # mean square that is stated as 99 dB


@dataclass(frozen=True)
class Painted:
    """A sampled surface and its colours; its faces are those of the paint's asset."""

    surface: SampledSurface
    paint: Paint


def compare_colours(
    judged: Painted, source: Painted, reference: Painted, again: SampledSurface
) -> Appearance | None:
    """Compare the colours of a mesh with those of its reference, both ways.

    Each sample's colour is compared with that at the closest point of the other surface that
    faces the same way. The closest points are those that the distances were taken from.

    Args:
        judged: the refined mesh, or the source where nothing was refined.
        source: as it came.
        reference: what both are compared with.
        again: the reference with other samples, for the floor.

    Returns:
        None where the reference says nothing of its colour, or neither says what it is.
    """
    if not comparable(source.paint, reference.paint):
        return None
    surfaces = [source, Painted(again, reference.paint)]
    if judged.surface is not source.surface:
        surfaces.append(judged)
    facing = FacingSurface(reference.surface.mesh)
    pairs = [_pair(painted, reference, facing) for painted in surfaces]
    looked_up = _looked_up([side for pair in pairs for way in pair for side in way])
    found = [_compared(looked_up[start : start + 4]) for start in range(0, len(looked_up), 4)]
    faults = (source.paint.why_unknown, reference.paint.why_unknown)
    why = " · ".join(fault for fault in faults if fault is not None)
    return Appearance(
        color_difference=found[2] if len(found) > 2 else found[0],
        input=found[0],
        floor=found[1],
        why_not_tested=why or None,
    )


def comparable(source: Paint, reference: Paint) -> bool:
    """Whether the reference says its colour, and one of the two is known."""
    known = source.has_colour or reference.has_colour
    return known and reference.claims_colour


def differences_at(
    spots: Spots, ours: tuple[Mesh, Paint], theirs: tuple[Mesh, Paint]
) -> Floats | None:
    """CIEDE2000 (k,) between points of a surface and the closest on another that face their way.

    Args:
        spots: (k,) points of the first surface.
        ours: that surface, and its colours.
        theirs: the one that it is compared with, in the same frame, and its colours.

    Returns:
        None where some colour is not known.
    """
    mesh, paint = ours
    points = np.einsum("kc,kcd->kd", spots.weights, mesh.corners[spots.faces])
    normals = mesh.face_normals[spots.faces]
    found = SurfaceTree(theirs[0]).closest(points)
    agreeing = np.sign(row_dot(normals, theirs[0].face_normals[found.faces])).sum()
    # Where most normals oppose each other, one of the two is inside out.
    sign = -1.0 if agreeing < 0 else 1.0
    closest = FacingSurface(theirs[0]).closest(points, sign * normals, found)
    there = Spots(closest.faces, barycentric_weights(closest.points, theirs[0], closest.faces))
    here = shown(paint.colours([spots])[0]), shown(theirs[1].colours([there])[0])
    if any(np.isnan(colours).any() for colours in here):
        return None
    return differences(*map(to_lab, here))


_Side = tuple[Paint, Spots]


def _pair(
    painted: Painted, reference: Painted, facing: FacingSurface
) -> tuple[tuple[_Side, _Side], ...]:
    """The samples of either surface, and the points on the other to compare them with."""
    ways = (
        (painted, reference, facing),
        (reference, painted, FacingSurface(painted.surface.mesh)),
    )
    searches = [_Search(here.surface, there.surface) for here, there, _ in ways]
    # Where most normals oppose each other, one of the two is inside out.
    sign = -1.0 if sum(search.agreeing for search in searches) < 0 else 1.0
    return tuple(
        ((here.paint, search.own_spots()), (there.paint, search.spots_there(surface, sign)))
        for (here, there, surface), search in zip(ways, searches, strict=True)
    )


class _Search:
    """The samples of a surface and what they find on another."""

    def __init__(self, here: SampledSurface, there: SampledSurface) -> None:
        self._here, self._there = here, there
        self._samples = here.samples
        self._found = here.closest_on(there, first=len(self._samples.points))
        normals = there.mesh.face_normals[self._found.faces]
        self.agreeing = float(np.sign(row_dot(self._samples.normals, normals)).sum())

    def own_spots(self) -> Spots:
        return _spots(self._here, self._samples.points, self._samples.faces)

    def spots_there(self, facing: FacingSurface, sign: float) -> Spots:
        samples = self._samples
        closest = facing.closest(samples.points, sign * samples.normals, self._found)
        return _spots(self._there, closest.points, closest.faces)


def _spots(surface: SampledSurface, points: Floats, faces: Ints) -> Spots:
    return Spots(faces, barycentric_weights(points, surface.mesh, faces))


def _looked_up(sides: Sequence[_Side]) -> list[Floats]:
    """The colours of each side; those of one paint are asked for together."""
    found: dict[int, Floats] = {}
    for paint in {id(paint): paint for paint, _ in sides}.values():
        numbers = [number for number, (owner, _) in enumerate(sides) if owner is paint]
        colours = paint.colours([sides[number][1] for number in numbers])
        found |= dict(zip(numbers, colours, strict=True))
    return [found[number] for number in range(len(sides))]


def _compared(sides: Sequence[Floats]) -> Compared:
    """Compare the first with the second and the third with the fourth, (k, 4) each."""
    here, there = (shown(np.concatenate(sides[first::2])) for first in (0, 1))
    if np.isnan(here).any() or np.isnan(there).any():
        return "not_tested"
    found = differences(to_lab(here), to_lab(there))
    error = float(np.mean((to_encoded(here) - to_encoded(there)) ** 2))
    return ColorDifference(
        mean=float(found.mean()),
        p95=float(np.quantile(found, 0.95)),
        max=float(found.max()),
        psnr=-10 * float(np.log10(max(error, _LEAST_ERROR))),
    )
