"""Re-proving an interval from what a search has left, without a search.

Nothing in here asks for closest points: a bound holds for whatever faces, weights and cuts
the record names. It can be loose, where they are chosen badly; it cannot be wrong.
"""

from __future__ import annotations

import numpy as np

from meshcone.quality.deviation.leaves import WEIGHT_PARTS, Leaves
from meshcone.quality.deviation.placing import Placed
from meshcone.quality.deviation.triangles import Triangles, corners_among
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, Ints

# Leaves bounded at a time: memory stays within some tens of megabytes.
_BLOCK = 65536


def check_leaves(mesh: Mesh, reference: Mesh, leaves: Leaves) -> float:
    """Prove how far any point of a mesh lies from its reference at most.

    Args:
        mesh: whose points are asked about.
        reference: in the same unit.
        leaves: how the mesh was divided, and which faces of the reference bound each piece.

    Returns:
        The bound, in the meshes' unit; rounding is added to it. It is 0 where every
        face of the mesh is bounded by one that has the same corners.

    Raises:
        InputError: the leaves do not tile the mesh, a leaf has no valid bound, or a mesh has
            no faces or a position that is not finite.
    """
    placed = Placed.of(mesh, reference)
    leaves.require_sound(len(mesh.faces), len(reference.faces))
    triangles = Triangles(placed.reference)
    first = np.cumsum(leaves.count) - leaves.count
    bound, equal = 0.0, True
    for corners, places, uncut in leaves.pieces(placed.mesh.corners):
        for start in range(0, len(corners), _BLOCK):
            block = slice(start, start + _BLOCK)
            found = _bounds(triangles, leaves, corners[block], first, places[block])
            bound = max(bound, float(found.max()))
            if equal:
                named = leaves.faces[first[places[block]]]
                single = leaves.count[places[block]] == 1
                within = corners_among(corners[block], placed.reference.corners[named])
                equal = uncut and bool((single & within).all())
    return 0.0 if equal else (bound + placed.rounding) * placed.unit


def _bounds(
    triangles: Triangles, leaves: Leaves, corners: Floats, first: Ints, places: Ints
) -> Floats:
    """Largest mixed distance of each leaf's corners, (k,)."""
    mixed = np.zeros((len(corners), 3))
    count = leaves.count[places]
    for number in range(int(count.max(initial=0))):
        rows = np.flatnonzero(count > number)
        entry = first[places[rows]] + number
        weights, faces = leaves.weights[entry] / WEIGHT_PARTS, leaves.faces[entry]
        for corner in range(3):
            distances = triangles.distances(corners[rows, corner], faces)
            mixed[rows, corner] += weights * distances
    return np.asarray(mixed.max(axis=1))
