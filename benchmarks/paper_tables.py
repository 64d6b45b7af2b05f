"""The paper's tables in Markdown, its numbers beside those measured here."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from paper_program import DELTAS, LAMBDAS, TIGHT, Setting

# Of the paper's tables, column by column; PAPER says whose row it is.
PAPER = "*the paper*:"
_PAPER_METRICS = {
    "marching cubes": (0.0038, 0.125, 0.311, 0.686, 0.062),
    "Poisson": (0.0226, 0.221, 0.594, 0.519, 0.065),
    "MeshCone": (0.003, 0.081, 0.036, 0.917, 0.038),
}
_PAPER_LAMBDAS = {
    0.001: (0.0367, 0.917, 1.12),
    0.01: (0.0365, 0.918, 1.22),
    0.1: (0.037, 0.915, 1.23),
}
_PAPER_DELTAS = {
    0.005: (0.330, 0.688, 4.74),
    0.05: (0.075, 0.894, 1.58),
    0.5: (0.038, 0.917, 1.22),
}
_PAPER_SCANS = {
    "Beethoven": ((2.022, 0.092, 0.165), (1.862, 0.091, 0.160)),
    "Actaeon": ((1.696, 0.0674, 0.095), (1.161, 0.0670, 0.092)),
    "Goat": ((2.488, 0.090, 0.165), (1.935, 0.086, 0.147)),
}
TITLES = {
    "target": "**floor**: the reference against itself",
    "sphere_same": "input: sphere with the reference's faces",
    "paper_same": "→ centroid program (a copy of the reference)",
    "surface_same": "→ surface program, fast",
    "best_same": "→ surface program, best",
    "sphere_own": "input: sphere with faces of its own",
    "paper_own": "→ centroid program",
    "surface_own": "→ surface program, fast",
    "best_own": "→ surface program, best",
    "laplacian_own": "→ Laplacian",
    "projection_own": "→ closest-point projection",
    "marching_cubes": "marching cubes at 64³",
    "surface_cubes": "→ surface program, fast",
    "poisson": "Poisson of 10,000 points",
}
_SCAN_STEPS = ("marching_cubes", "paper_cubes", "surface_cubes")
_SAMPLED = ("chamfer", "emd", "hausdorff", "normals", "curvature")
_EXACT = ("distance", "surface_normals", "aspect_median")
_SMALLEST_WRITTEN_OUT = 1e-5
_MISSING = "–"  # noqa: RUF001 - as in the other tables of docs/


@dataclass(frozen=True)
class Results:
    """What is known of each shape, by its name.

    Attributes:
        main, scans: of the shapes of the main tables and of the table of scans.
        emd_samples, more_emd_samples: how many the earth mover's distances were taken from.
    """

    main: Mapping[str, dict[str, Any]]
    scans: Mapping[str, dict[str, Any]]
    emd_samples: int
    more_emd_samples: int

    def mean(self, stage: str, row: str, key: str) -> float:
        """Mean of a number over the shapes that have it; NaN if none has."""
        return float(np.mean(self.values(stage, row, key) or [np.nan]))

    def median(self, stage: str, row: str, key: str) -> float:
        """Median of a number over the shapes that have it; NaN if none has."""
        return float(np.median(self.values(stage, row, key) or [np.nan]))

    def values(self, stage: str, row: str, key: str) -> list[float]:
        """A number of every shape that has it."""
        found = (shape.get(stage, {}).get(row, {}).get(key) for shape in self.main.values())
        return [value for value in found if value is not None]

    def count(self, stage: str) -> int:
        """How many shapes have a stage."""
        return sum(stage in shape for shape in self.main.values())


def all_tables(results: Results) -> Iterator[str]:
    """Every table, line by line."""
    yield from _section("Solver", results.count("metrics"), solver_table(results))
    yield from _section("Metrics, means", results.count("metrics"), metrics_table(results))
    yield from _section("Metrics, medians", results.count("metrics"), exact_table(results))
    for title, settings, paper in (
        ("λ, at δ 0.5", LAMBDAS, {s.key: _PAPER_LAMBDAS[s.regularization] for s in LAMBDAS}),
        ("δ, at λ 0.1", DELTAS, {s.key: _PAPER_DELTAS[s.edge_cap] for s in DELTAS}),
    ):
        rows = ablation_table(results, settings, paper)
        yield from _section(title, results.count("ablations"), rows)
    yield from _section("Detailed scans", len(results.scans), scan_table(results))


def solver_table(results: Results) -> list[list[str]]:
    """Seconds, iterations and success of the paper's program."""
    rows = [["", "mean s", "mean iterations", "solved"]]
    rows.append([f"{PAPER} 53 meshes", "1.22", "25", "100 %"])
    for stage, name, title in (
        ("metrics", "paper_same", "as written, CVXPY and SCS"),
        ("solver", "reduced", "reduced form, SCS"),
    ):
        numbers = [results.mean(stage, name, key) for key in ("seconds", "iterations", "solved")]
        titled = title + _if_fewer(results, stage, name)
        rows.append([titled, short(numbers[0]), short(numbers[1]), _percent(numbers[2])])
    return rows


def metrics_table(results: Results) -> list[list[str]]:
    """The paper's five metrics between samples."""
    emd = f"EMD, {results.emd_samples:,}"
    more = f"EMD, {results.more_emd_samples:,} ({results.count('emd')} shapes)"
    rows = [["", "CD", more, emd, "HD", "NC", "CE"]]
    for method, (chamfer, distance, *others) in _PAPER_METRICS.items():
        cells = [short(chamfer), short(distance), _MISSING, *map(short, others)]
        rows.append([f"{PAPER} {method}", *cells])
    for name, title in TITLES.items():
        found = {key: short(results.mean(_stage(name), name, key)) for key in _SAMPLED}
        extra = short(results.mean("emd", name, "emd"))
        titled = title + _if_fewer(results, _stage(name), name)
        rows.append([titled, found.pop("chamfer"), extra, *found.values()])
    return rows


def exact_table(results: Results) -> list[list[str]]:
    """What is measured to the triangles themselves, and the shape of the faces."""
    rows = [["", "point to surface", "NC by closest triangle", "aspect ratio", "s"]]
    for name, title in TITLES.items():
        cells = [short(results.median(_stage(name), name, key)) for key in _EXACT]
        titled = title + _if_fewer(results, _stage(name), name)
        rows.append([titled, *cells, short(results.median(_stage(name), name, "seconds"))])
    return rows


def ablation_table(
    results: Results, settings: Sequence[Setting], paper: Mapping[str, tuple[float, ...]]
) -> list[list[str]]:
    """One row a setting: the paper's numbers, then ours."""
    theirs = [f"HD, {PAPER[:-1]}", f"NC, {PAPER[:-1]}", f"s, {PAPER[:-1]}"]
    rows = [["λ", "δ", *theirs, "HD", "NC", "s", "iterations", "solved", "caps reached"]]
    for setting in settings:
        stage = "tight" if setting == TIGHT else "ablations"
        mean = {
            key: results.mean(stage, setting.key, key)
            for key in ("hausdorff", "normals", "seconds", "iterations", "solved", "active")
        }
        ours = [short(mean[key]) for key in ("hausdorff", "normals", "seconds", "iterations")]
        fewer = _if_fewer(results, stage, setting.key)
        weights = [f"{setting.regularization:g}", f"{setting.edge_cap:g}{fewer}"]
        shares = [_percent(mean["solved"]), _percent(mean["active"])]
        rows.append([*weights, *map(short, paper[setting.key]), *ours, *shares])
    floor = [short(results.mean("ablations", "floor", key)) for key in ("hausdorff", "normals")]
    rows.append(["floor", "", "", "", "", *floor, "", "", "", ""])
    return rows


def scan_table(results: Results) -> list[list[str]]:
    """Each scan's raw mesh and what becomes of it, a scan a row."""
    steps = "raw → centroid → surface"
    rows = [["", "AR", f"EMD, {results.emd_samples:,}", "HD", "point to surface"]]
    for shape, (raw, refined) in _PAPER_SCANS.items():
        pairs = zip(raw, refined, strict=True)
        cells = [f"{short(before)} → {short(after)}" for before, after in pairs]
        rows.append([f"{PAPER} {shape}, raw → MeshCone", *cells, ""])
    done = {name: shape["metrics"] for name, shape in results.scans.items() if "metrics" in shape}
    for name, measured in done.items():
        rows.append([f"{name.partition('__')[0]}, {steps}", *_cells([measured], _SCAN_STEPS)])
    for title, meshes in (
        (f"mean, {steps}", _SCAN_STEPS),
        ("mean, Laplacian", ("laplacian_cubes",)),
        ("mean, floor", ("target",)),
    ):
        rows.append([title, *_cells(list(done.values()), meshes)])
    return rows


def short(number: float) -> str:
    """Three significant digits, without a zero before the point; rounding errors as powers."""
    if not np.isfinite(number):
        return _MISSING
    if 0 < abs(number) < _SMALLEST_WRITTEN_OUT:
        return f"{number:.0e}"
    digits = max(3, len(str(int(abs(number)))))
    text = np.format_float_positional(
        number, precision=digits, unique=False, fractional=False, trim="-"
    )
    return text.removeprefix("0") or "0"


def markdown(rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """A table whose first row is its head."""
    for index, row in enumerate(rows):
        yield f"| {' | '.join(row)} |"
        if index == 0:
            yield "|" + "---|" * len(row)


def _section(title: str, shapes: int, rows: list[list[str]]) -> Iterator[str]:
    yield f"## {title} ({shapes} shapes)\n"
    yield from markdown(rows)
    yield ""


def _cells(shapes: Sequence[Mapping[str, Any]], meshes: Iterable[str]) -> list[str]:
    """Of each metric of the scans, the means of some meshes over some shapes."""
    means = {
        key: [
            np.mean([shape[mesh][key] for shape in shapes if mesh in shape] or [np.nan])
            for mesh in meshes
        ]
        for key in ("aspect", "emd", "hausdorff", "distance")
    }
    return [" → ".join(map(short, found)) for found in means.values()]


def _if_fewer(results: Results, stage: str, row: str) -> str:
    """How many shapes a row is of, where that is not all."""
    count = sum(row in shape.get(stage, {}) for shape in results.main.values())
    return "" if count == results.count("metrics") else f" ({count} shapes)"


def _stage(mesh: str) -> str:
    return "best" if mesh.startswith("best_") else "metrics"


def _percent(share: float) -> str:
    return _MISSING if not np.isfinite(share) else f"{short(100 * share)} %"
