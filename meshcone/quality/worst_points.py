"""Where a mesh and its reference are farthest apart."""

from __future__ import annotations

import numpy as np

from meshcone.quality.records import WorstPoint
from meshcone.quality.sampled import SampledSurface
from meshcone.surface import Frame
from meshcone.surface.arrays import Floats, row_lengths

COUNT = 10
# Points nearer to each other than this share of the radius are one place.
SPACING = 0.1
# What is nearer to the other surface is there, up to rounding.
_NOTHING = 1e-9


def worst_points(
    surface: SampledSurface, reference: SampledSurface, frame: Frame
) -> tuple[WorstPoint, ...]:
    """Find the places that are farthest from the other surface, the worst first.

    Candidates are the samples and vertices of both, as for ``point_to_surface.max``, whose
    place is the first of the answer. Of candidates within a tenth of the radius only the
    worst counts: ten points on one spike would say no more than one.

    Args:
        surface: the judged mesh, in the frame.
        reference: in the frame.
        frame: that leads back to model units.

    Returns:
        At most ten points; fewer where the surfaces agree everywhere else.
    """
    there, back = surface.closest_on(reference), reference.closest_on(surface)
    points = np.concatenate([surface.points, reference.points])
    closest = np.concatenate([there.points, back.points])
    distances = np.concatenate([there.distances, back.distances])
    left = distances.copy()
    worst: list[WorstPoint] = []
    while len(worst) < COUNT and left[index := int(np.argmax(left))] > _NOTHING:
        worst.append(
            WorstPoint(
                on="mesh" if index < len(surface.points) else "reference",
                position=_triple(frame.out_of(points[index])),
                closest=_triple(frame.out_of(closest[index])),
                distance=float(distances[index]),
            )
        )
        left[row_lengths(points - points[index]) < SPACING] = 0
    return tuple(worst)


def _triple(point: Floats) -> tuple[float, float, float]:
    x, y, z = map(float, point)
    return (x, y, z)
