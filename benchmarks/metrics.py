"""What the metrics of one pair cost on one processor, part by part.

    OMP_NUM_THREADS=1 python benchmarks/metrics.py [--data DIRECTORY]

The pair is a mesh of about 4,000 vertices with noise, against itself without. Times are
processor seconds, the least of several runs: whatever else a machine does only adds to them.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from reference_shapes import Shape, load, made_shapes
from rich.console import Console
from rich.table import Table

from meshcone.options import Options, parse_options
from meshcone.report.scoring import Scorer
from meshcone.surface import Frame, Mesh

_VERTICES, _SMALLEST, _LARGEST = 4_000, 3_500, 4_500
_NOISE = (0.1, 0.3)  # of the mean edge length; the second crowds, folds and crosses faces
_REPEATS = 5


def main() -> None:
    """Measure every shape at every level of noise, and print a row for each."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--data", type=Path, help="a directory with objects/ in it")
    options = parse_options({})
    table = Table(title=f"metrics of input and floor, emd at {options.quality.emd_samples:,}")
    parts: list[str] = []
    for shape in shapes(arguments.parse_args().data):
        for noise in _NOISE:
            mesh = shape.load()
            seconds, spent = cost(noisy(mesh, noise), mesh, options)
            if not parts:
                parts = list(spent)
                for title in ("shape", "vertices", "noise", "cpu s", *parts):
                    table.add_column(title.replace("_", " "), justify="right")
            cells = [f"{seconds:.2f}", *(f"{spent[part]:.3f}" for part in parts)]
            table.add_row(shape.name, str(len(mesh.vertices)), str(noise), *cells)
    Console(width=150).print(table)


def shapes(directory: Path | None) -> Iterator[Shape]:
    """Shapes made here and, of a directory, those of the size asked for."""
    yield from made_shapes(_VERTICES)
    for path in sorted((directory / "objects").glob("*")) if directory else ():
        mesh = load(path)
        if _SMALLEST <= len(mesh.vertices) <= _LARGEST:
            yield Shape(path.name.split(".")[0], lambda mesh=mesh: mesh)


def noisy(mesh: Mesh, noise: float) -> Mesh:
    """The mesh with noise on every coordinate, in mean edge lengths."""
    offsets = np.random.default_rng(1).normal(size=mesh.vertices.shape)
    return mesh.moved_to(mesh.vertices + noise * mesh.edge_lengths.mean() * offsets)


def cost(source: Mesh, reference: Mesh, options: Options) -> tuple[float, dict[str, float]]:
    """Processor seconds of a whole measurement, and wall-clock seconds of its parts."""
    best, spent = np.inf, {}
    for _ in range(_REPEATS):
        # Nothing computed once may be found again.
        fresh = [Mesh(mesh.vertices, mesh.faces) for mesh in (source, reference)]
        begin = time.process_time()
        scorer = Scorer(*fresh, options)
        scorer.quality(refined=None, frame=Frame.of(fresh[1]))
        seconds = time.process_time() - begin
        if seconds < best:
            best, spent = seconds, scorer.seconds
    return best, spent


if __name__ == "__main__":
    main()
