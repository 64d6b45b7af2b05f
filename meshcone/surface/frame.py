"""The similarity that puts the reference into the unit sphere."""

from __future__ import annotations

from dataclasses import dataclass

from meshcone.errors import InputError
from meshcone.surface.arrays import Floats, row_lengths
from meshcone.surface.mesh import Mesh


@dataclass(frozen=True)
class Frame:
    """A translation and a uniform scale.

    Attributes:
        centre: (3,) the point that becomes the origin, in model units.
        radius: the distance that becomes 1, in model units.
    """

    centre: Floats
    radius: float

    @staticmethod
    def of(reference: Mesh) -> Frame:
        """Centre on the bounding box's centre and scale by the largest distance from it.

        This is the normalisation of the paper's experiments ("normalized meshes in a
        unit sphere").

        Raises:
            InputError: the reference has no extent.
        """
        used = reference.vertices[reference.used_vertices]
        centre = (used.min(axis=0) + used.max(axis=0)) / 2
        radius = float(row_lengths(used - centre).max())
        if not radius > 0:
            raise InputError("the reference has no extent: all of its vertices coincide")
        return Frame(centre, radius)

    def into(self, points: Floats) -> Floats:
        """Map (k, 3) points from model units into the frame."""
        return (points - self.centre) / self.radius

    def out_of(self, points: Floats) -> Floats:
        """Map (k, 3) points from the frame back to model units."""
        return points * self.radius + self.centre
