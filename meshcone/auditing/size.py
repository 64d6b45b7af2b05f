"""How large an asset is, and where it stands."""

from __future__ import annotations

import numpy as np

from meshcone.auditing.records.size import Size
from meshcone.auditing.subject import Subject

_CLOSE = 0.01  # of the box's size: what counts as centred, or as standing on the floor


def size_of(subject: Subject) -> Size:
    """Measure the box, and where the origin lies in it."""
    low, high = subject.box
    extent = high - low
    middle = np.abs(low + high) / 2
    near = _CLOSE * np.maximum(extent, _CLOSE * subject.diagonal)
    roots = [node for node in subject.content.nodes if node.depth == 1]
    return Size(
        width=float(extent[0]),
        height=float(extent[1]),
        depth=float(extent[2]),
        diagonal=subject.diagonal,
        low=(float(low[0]), float(low[1]), float(low[2])),
        high=(float(high[0]), float(high[1]), float(high[2])),
        origin_centred=bool(middle[0] <= near[0] and middle[2] <= near[2]),
        origin_on_floor=bool(abs(low[1]) <= near[1]),
        clean_root=all(np.array_equal(root.matrix, np.eye(4)) for root in roots),
    )
