"""Which object, group and material each face of an OBJ file is in.

Source: "Object Files (.obj)", appendix B1: ``o``, ``g`` and ``usemtl`` hold for all
elements that follow, until the next statement of their kind.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.obj.scan import ObjLines
from meshcone.assets.regions import Regions, combine_parts


def face_regions(lines: ObjLines, rows: NDArray[np.int64]) -> Regions:
    """Label polygons by what is in force where they are stated.

    Args:
        lines: the file.
        rows: (k,) statement of each polygon.
    """
    parts, columns = [], []
    for markers in (lines.objects, lines.groups, lines.materials):
        names = ["", *lines.names(markers)]  # nothing is in force before the first of them
        numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
        in_force = np.array([numbers[name] for name in names])
        columns.append(in_force[np.searchsorted(markers, rows)])
        parts.append(list(numbers))
    return combine_parts(parts, np.stack(columns, axis=1))
