"""How a file is written back: what may be renewed, copied, compressed, or moved at all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

NormalsPolicy = Literal["recompute", "keep"]
InstancesPolicy = Literal["auto", "split", "refuse"]
DracoPolicy = Literal["plain", "encode"]
PosePolicy = Literal["rest", "bind"]


@dataclass(frozen=True, eq=False)
class WritePolicy:
    """What writing may do besides moving vertices.

    Attributes:
        normals: ``recompute`` also writes stored normals (see ``normals.py`` for the rule),
            ``keep`` leaves them alone.
        instances: what happens to a mesh or vertex data used more than once: ``refuse`` it,
            ``split`` it into a copy for each use that moves, or, with ``auto``, split what cannot
            be moved once because its uses ask for different shapes.
        draco: whether what was compressed with Draco is written as ``plain`` buffers or
            compressed again (``encode``).
        selected: (m,) faces that may move, or None for all. A vertex of any other face stays,
            and so does a normal that any other face uses.
    """

    normals: NormalsPolicy = "recompute"
    instances: InstancesPolicy = "refuse"
    draco: DracoPolicy = "plain"
    selected: NDArray[np.bool_] | None = None

    def fixed_vertices(self, faces: NDArray[np.int64], count: int) -> NDArray[np.bool_]:
        """(n,) which of ``count`` vertices stay, because a face that is not selected uses them.

        Args:
            faces: (m, 3) vertices of each face.
            count: number of vertices.
        """
        fixed = np.zeros(count, dtype=bool)
        if self.selected is not None:
            fixed[faces[~self.selected]] = True
        return fixed
