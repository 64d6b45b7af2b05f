"""Cone tension: how hard each vertex is held by the constraints at it.

The multiplier of a cone is the rate at which the objective would fall if the cone gave
way (the paper reads multipliers as geometric regularisers); its norm, spread to the
vertices the cone touches, shows where on the mesh the constraints work.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from meshcone.program.multipliers import Multipliers
from meshcone.surface.arrays import Floats, row_lengths


def vertex_tension(multipliers: Sequence[Multipliers], vertex_count: int) -> Floats:
    """Sum the norms of the multipliers of the cones at each vertex, (n,).

    The unit is that of the objective over length in the frame.
    """
    tension = np.zeros(vertex_count)
    for entry in multipliers:
        strength = row_lengths(entry.values)
        touched = entry.family.vertices[entry.which]
        np.add.at(tension, touched.ravel(), np.repeat(strength, touched.shape[1]))
    return tension
