"""Pairs of files for the engine, and the options it is tried with."""

from __future__ import annotations

from typing import Any

from meshcone.files import MeshFile
from tests import shapes

RADIUS = 2.0  # of the reference, in model units
CAPPED: dict[str, Any] = {"effort": "fast", "cones": {"max_displacement": {"relative": 0.02}}}

# One setting for each formulation, form, effort, method and kind of cone.
SETTINGS: dict[str, dict[str, Any]] = {
    "fast": {"effort": "fast"},
    "best": {"effort": "best"},
    "max_displacement": CAPPED,
    "pin": {"effort": "fast", "cones": {"pin": {"vertices": [0, 1, 2, 3]}}},
    "tolerance_band": {"effort": "fast", "cones": {"tolerance_band": {"relative": 0.001}}},
    "edge_cap": {"effort": "fast", "cones": {"edge_cap": {"times_local_median": 1.1}}},
    "aligned": {"effort": "fast", "align": "similarity"},
    "full": {**CAPPED, "solver": {"method": "full"}},
    "centroid": {"formulation": "centroid"},
    "centroid, capped": {
        "formulation": "centroid",
        "centroid": {"regularization": 1.0, "edge_cap": 0.08},
    },
    "centroid, cvxpy": {
        "formulation": "centroid",
        "centroid": {"regularization": 1.0, "edge_cap": 0.08, "form": "cvxpy"},
    },
}


def rough(name: str = "rough.obj", seed: int = 7) -> MeshFile:
    """A ball of 66 vertices with noise on it; the name says in which format."""
    vertices, faces = shapes.sphere(2, RADIUS)
    write = shapes.glb if name.endswith(".glb") else shapes.obj
    return MeshFile(name, write(shapes.noisy(vertices, seed=seed), faces))


def smooth(radius: float = RADIUS) -> MeshFile:
    """The ball it should have been, with other vertices."""
    return MeshFile("smooth.obj", shapes.obj(*shapes.sphere(3, radius)))
