"""Where the time of one surface refinement goes.

    OPENBLAS_NUM_THREADS=1 python -m benchmarks.profile_engine [--subdivisions 5 7]

Prints, for bumpy spheres of its own with 2 % noise, the seconds of processor time spent in
closest points, in building trees for them, in CG, and in everything else; the first three are
the floor: one pass each way over the trees and one linear solve per round.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import time

import numpy as np
import trimesh

from meshcone.options import parse_options
from meshcone.program.rounds import refine_surface
from meshcone.surface import Mesh

# What is counted under which heading: the end of the file's name, and the function.
_HEADINGS: dict[str, tuple[tuple[str, str], ...]] = {
    "closest points": (("surface/closest.py", "closest"),),
    "trees": (("surface/closest.py", "__init__"),),
    "CG": (("program/relaxation.py", "solve_relaxation"),),
    "barycentric weights": (("surface/closest.py", "barycentric_weights"),),
    "cones": (
        ("cones/edge_cap.py", "slack"),
        ("cones/edge_cap.py", "relative"),
        ("surface/mesh.py", "edges"),
    ),
    "normals": (
        ("surface/mesh.py", "vertex_normals"),
        ("surface/mesh.py", "face_normals"),
    ),
    "sampling": (("surface/sampling.py", "sample_surface"),),
}


def bumpy_sphere(subdivisions: int) -> Mesh:
    """A sphere with bumps: 10,242 vertices for 5 subdivisions, four times more for each on top."""
    made = trimesh.creation.icosphere(subdivisions=subdivisions)
    x, y, z = np.asarray(made.vertices).T
    radius = (1 + 0.1 * np.sin(5 * x) * np.cos(4 * y) * np.sin(3 * z + 1)) / 1.1
    return Mesh(made.vertices * radius[:, None], made.faces)


def noisy_copy(reference: Mesh) -> Mesh:
    """The mesh with 2 % of seeded noise."""
    noise = np.random.default_rng(1).normal(size=reference.vertices.shape)
    return reference.moved_to(reference.vertices + 0.02 * noise)


def account(subdivisions: int) -> tuple[int, float, dict[str, float]]:
    """Refine once under the profiler.

    Returns:
        The number of vertices, the seconds in all, and the seconds under each heading.
    """
    reference = bumpy_sphere(subdivisions)
    source = noisy_copy(reference)
    options = parse_options({"effort": "fast", "solver": {"certify": False}})
    profile = cProfile.Profile(time.process_time)
    started = time.process_time()
    profile.runcall(refine_surface, source, reference, options)
    total = time.process_time() - started
    seconds = dict.fromkeys(_HEADINGS, 0.0)
    for (file, _, function), entry in pstats.Stats(profile).stats.items():  # type: ignore[attr-defined]
        for heading, places in _HEADINGS.items():
            if any(file.endswith(end) and function == name for end, name in places):
                seconds[heading] += entry[3]
    return len(source.vertices), total, seconds


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--subdivisions", type=int, nargs="+", default=[4, 5, 7])
    arguments = parser.parse_args()
    account(1)  # imports, and what is compiled at the first use, are not of a refinement
    for subdivisions in arguments.subdivisions:
        vertices, total, seconds = account(subdivisions)
        print(f"\n{vertices:,} vertices, {total:.3f} s")
        for heading, spent in seconds.items():
            print(f"  {heading:<20} {spent:8.3f} s  {spent / total:4.0%}")
        rest = total - sum(seconds.values())
        print(f"  {'everything else':<20} {rest:8.3f} s  {rest / total:4.0%}")


if __name__ == "__main__":
    main()
