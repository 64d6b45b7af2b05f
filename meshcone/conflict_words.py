"""Saying a contradiction among the requested constraints in words."""

from __future__ import annotations

import numpy as np

from meshcone.errors import InfeasibleError
from meshcone.formulation import Formulated
from meshcone.pair import Pair
from meshcone.program.infeasibility import Conflict, ContradictionError

_VERTICES_NAMED = 10
_RELIEF = {
    "edge_cap": "allow longer edges (cones.edge_cap, surface.edge_cap)",
    "max_displacement": "allow more movement (cones.max_displacement)",
    "pin": "pin fewer vertices (cones.pin)",
    "tolerance_band": "widen the band or align the meshes first (cones.tolerance_band, align)",
    **dict.fromkeys(
        ("stay", "stay_on_edges", "stay_on_faces"),
        "allow a smaller distance or the other side (cones.offset, cones.stay)",
    ),
}


def in_words(error: ContradictionError, pair: Pair, problem: Formulated) -> InfeasibleError:
    """Name the kinds in conflict, the vertices by their index in the file, and what to relax."""
    kinds = " and ".join(f"{c.kind} ({c.count})" for c in error.conflicts)
    where = "; ".join(_vertex(problem.in_source(index), pair) for index in _worst(error.conflicts))
    relief = ", or ".join(dict.fromkeys(_RELIEF[c.kind] for c in error.conflicts))
    return InfeasibleError(
        f"no mesh satisfies the requested constraints: {kinds} contradict each other "
        f"at {where}. To relax: {relief}",
        file=pair.source_asset.name,
    )


def _worst(conflicts: tuple[Conflict, ...]) -> list[int]:
    """Take vertices from each kind in turn, the heaviest first, without repeating any."""
    longest = max(len(conflict.vertices) for conflict in conflicts)
    turns = [
        int(conflict.vertices[turn])
        for turn in range(longest)
        for conflict in conflicts
        if turn < len(conflict.vertices)
    ]
    return list(dict.fromkeys(turns))[:_VERTICES_NAMED]


def _vertex(index: int, pair: Pair) -> str:
    in_file = int(np.flatnonzero(pair.source_asset.weld == index)[0])
    x, y, z = pair.source_asset.vertices[index]
    return f"vertex {in_file} ({x:.4g}, {y:.4g}, {z:.4g})"
