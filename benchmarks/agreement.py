"""Whether others compute the same: every metric with a second implementation, on real shapes.

    OMP_NUM_THREADS=1 python benchmarks/agreement.py --data DIRECTORY [--all]

Each shape of DIRECTORY/objects and DIRECTORY/scans (every eighth, or all) is measured with noise
on it against itself without, by this engine and by scipy, point-cloud-utils, libigl and VTK from
the same samples. Printed are the largest relative differences over the shapes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from reference_shapes import stored_shapes
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1]))
from meshcone.quality.metrics import compare
from meshcone.quality.sampled import SampledSurface, Sampling
from meshcone.quality.validity import inspect
from meshcone.surface import Mesh
from tests.independent import earth_movers_distance, measure_independently

_SAMPLING = Sampling(samples=5000, emd_samples=1024, curvature_samples=16)
_NOISE = 0.01  # of the radius


def main() -> None:
    """Measure the shapes and print the table."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--data", type=Path, required=True)
    arguments.add_argument("--all", action="store_true", help="every shape")
    given = arguments.parse_args()
    rows: dict[str, dict[str, float]] = {}
    for shape in stored_shapes(given.data, small=not given.all):
        rows[shape.name] = differences(shape.load())
        print(shape.name, file=sys.stderr, flush=True)
    print_table(rows)


def differences(reference: Mesh) -> dict[str, float]:
    """Relative differences of ours to theirs, by metric."""
    offsets = np.random.default_rng(1).normal(size=reference.vertices.shape)
    mesh = reference.moved_to(reference.vertices + _NOISE * offsets)
    surface, other = SampledSurface(mesh, _SAMPLING, 0), SampledSurface(reference, _SAMPLING, 1)
    ours = compare(surface, other, inspect(mesh, 0))
    theirs = measure_independently(surface, other)
    matched = earth_movers_distance(surface.matching, other.matching)
    pairs = {
        "emd (scipy, sparse matching)": (ours.emd, matched),
        "chamfer (point-cloud-utils)": (ours.chamfer, theirs.chamfer),
        "chamfer_l1 (point-cloud-utils)": (ours.chamfer_l1, theirs.chamfer_l1),
        "hausdorff (point-cloud-utils)": (ours.hausdorff, theirs.hausdorff),
        "point_to_surface.mean (VTK)": (ours.point_to_surface.mean, theirs.point_to_surface_mean),
        # Of the vertices only, so that ours may be larger.
        "point_to_surface.max below libigl's": (
            max(theirs.vertex_hausdorff, ours.point_to_surface.max),
            ours.point_to_surface.max,
        ),
        "aspect_ratio.mean (VTK)": (ours.aspect_ratio.mean, theirs.aspect_ratio),
    }
    return {name: abs(a - b) / max(abs(b), 1e-300) for name, (a, b) in pairs.items()}


def print_table(rows: Mapping[str, Mapping[str, float]]) -> None:
    """Print, for each metric, the median and largest difference and where that is."""
    table = Table(title=f"relative difference over {len(rows)} shapes")
    table.add_column("metric (whose)")
    for title in ("median", "largest", "of"):
        table.add_column(title, justify="right")
    for name in next(iter(rows.values())):
        found = {shape: row[name] for shape, row in rows.items()}
        worst = max(found, key=lambda shape: found[shape])
        median = float(np.median(list(found.values())))
        table.add_row(name, f"{median:.1e}", f"{found[worst]:.1e}", worst)
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
