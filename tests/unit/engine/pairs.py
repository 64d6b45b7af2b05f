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
    "stay": {
        "effort": "fast",
        "cones": {"stay": "outside", "offset": {"relative": 0.01}},
    },
    "edge_cap": {"effort": "fast", "cones": {"edge_cap": {"times_local_median": 1.1}}},
    "aligned": {"effort": "fast", "align": "similarity"},
    "regions": {"effort": "best", "surface": {"regions": 3}},
    "regions, capped": {**CAPPED, "surface": {"regions": 3}},
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


def with_a_seam(mesh: MeshFile) -> MeshFile:
    """Store the first vertex twice, and have the last face that uses it use the copy."""
    lines = mesh.data.splitlines()
    faces = [number for number, line in enumerate(lines) if b"1" in line.split()[1:]]
    corners = [b"67" if corner == b"1" else corner for corner in lines[faces[-1]].split()]
    lines[faces[-1]] = b" ".join(corners)
    return MeshFile(mesh.name, b"\n".join([*lines[:66], lines[0], *lines[66:]]) + b"\n")
