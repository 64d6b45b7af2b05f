"""What there is to see of a pair: its surfaces, and what was found at each vertex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.appearance.paint import Paint
from meshcone.quality.parts import Partition
from meshcone.surface import Frame, Mesh
from meshcone.surface.arrays import Floats


@dataclass(frozen=True)
class Surface:
    """A mesh with its distance from the other surface of its pair.

    Attributes:
        mesh: in the frame.
        deviation: (n,) exact distance of each vertex to the other surface, in the frame; zero
            for a vertex no face uses.
    """

    mesh: Mesh
    deviation: Floats


@dataclass(frozen=True)
class Scene:
    """A source, its reference and, if there is one, the refined mesh.

    Attributes:
        frame: that leads back to model units.
        input: the source as it came, against the reference.
        refined: with the faces of ``input``; None where nothing was refined.
        reference: against the refined mesh, or the input where there is none.
        tension: (n,) how hard the constraints hold each vertex of the refined mesh, see
            :func:`meshcone.program.tension.vertex_tension`; None where there is no program.
        paints: the colours of source, which are the refined mesh's too, and reference; None
            where nobody asked for colours.
        parts: of source, which are the refined mesh's too, and reference; None where they are
            not told apart.
        closed: the reference's mesh, if it has an inside.
    """

    frame: Frame
    input: Surface
    refined: Surface | None
    reference: Surface
    tension: Floats | None = None
    paints: tuple[Paint, Paint] | None = None
    parts: tuple[Partition, Partition] | None = None
    closed: Mesh | None = None


def spread_to_vertices(mesh: Mesh, values: Floats) -> Floats:
    """Give values (u,) of the vertices that some face uses to all (n,), zero to the others."""
    spread = np.zeros(len(mesh.vertices))
    spread[mesh.used_vertices] = values
    return spread
