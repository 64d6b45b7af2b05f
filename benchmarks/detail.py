"""Detail beside uniform subdivision: coarse copies of shapes, given faces and refined.

    OMP_NUM_THREADS=1 python benchmarks/detail.py --data DIRECTORY [--shapes N] [--faces N]

Each of 8 shapes is first brought down to so many faces at most (16,000), which is the reference,
and then to 5, 10 and 25 % of them, which are the sources. Every source is refined with the faces
that it has; divided uniformly and refined, with and without swapped diagonals; and with detail,
all at the same number of faces. The last column is the reference brought down to as many: it has
no texture coordinates left, which is why it is no answer. "one chart" swaps diagonals across
faces too; "charts" does so within charts made by projecting each face along its axis. Distances are
those of 20,000 samples either way and of all vertices, and proven, in radii; a ratio is to uniform
subdivision of the same budget. A last table is of a tolerance. Seconds are of the processor.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import mean
from typing import Any

import fast_simplification
import numpy as np
from reference_shapes import load
from rich.console import Console
from rich.table import Table

from meshcone.detail.choosing import choose_edges
from meshcone.detail.divided_mesh import DividedMesh
from meshcone.detail.flips import flip_inside
from meshcone.detail.levels import find_detail
from meshcone.detail.misses import Misses
from meshcone.detail.tangles import are_many, new_tangles
from meshcone.options import Options, parse_options
from meshcone.program.rounds import SurfaceRefiner, refine_surface
from meshcone.program.surface_problem import SurfaceProblems
from meshcone.quality.deviation.bars import Bars
from meshcone.quality.deviation.proving import prove_deviation
from meshcone.quality.intersections import count_self_intersections
from meshcone.quality.metrics import aspect_ratio
from meshcone.quality.sampled import SampledSurface
from meshcone.report.scoring import sampling_of
from meshcone.surface import Frame, Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats, row_dot
from meshcone.surface.charts import Charts

SHAPES = (
    "scans/spot_cow__oded",
    "scans/penguin__oded",
    "scans/fish_blub__oded",
    "scans/nefertiti_lowres__oded",
    "objects/hammer__oded",
    "objects/shoe__gso",
    "objects/teapot__gso",
    "objects/toy_lion__gso",
)
SHARES = (0.05, 0.10, 0.25)
BUDGETS = (2, 4)
METHODS = (
    *("none", "uniform", "uniform, swapped"),
    *("detail", "detail, one chart", "detail, charts", "decimated"),
)
WITHIN = ("none", "detail", "detail, one chart", "detail, charts")
TOLERANCE = 0.001  # of the 95th percentile
OPTIONS = parse_options({"effort": "fast", "solver": {"certify": False}})
_SAMPLES = 20_000
_SAMPLING = sampling_of(OPTIONS.quality)
_MOST_PAIRS = 10_000_000


@dataclass(frozen=True)
class Result:
    """A mesh beside its reference; distances in radii."""

    mean: float
    p95: float
    farthest: float
    proven: float
    normals: float
    aspect: float
    faces: int
    crossing: int
    seconds: float


def main() -> None:
    """Measure all pairs and print a row for each, and the means."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--data", type=Path, required=True)
    arguments.add_argument("--shapes", type=int, default=len(SHAPES))
    arguments.add_argument("--faces", type=int, default=16_000, help="of a reference, at most")
    arguments.add_argument("--only", default="", help="shapes whose name has this in it")
    chosen = arguments.parse_args()
    names = [name for name in SHAPES[: chosen.shapes] if chosen.only in name]
    found: dict[int, list[dict[str, Result]]] = {budget: [] for budget in BUDGETS}
    reached: list[dict[str, Result]] = []
    console = Console(width=160)
    for name in names:
        whole = load(chosen.data / f"{name}.obj")
        reference = decimated(whole, min(chosen.faces, len(whole.faces)))
        for share in SHARES:
            source = decimated(reference, int(share * len(reference.faces)))
            for budget, results in compared(source, reference):
                found[budget].append(results)
                console.print(row(f"{name} {share:.0%} {budget}x", results))
            reached.append(
                within(source, reference)
                | {"source": measured(SurfaceTree(reference), source, 0.0)}
            )
    for budget, pairs in found.items():
        console.print(summary(budget, pairs))
    console.print(of_tolerance(reached))


def compared(source: Mesh, reference: Mesh) -> Iterator[tuple[int, dict[str, Result]]]:
    """Give a source faces in every way, for every budget."""
    tree, options = SurfaceTree(reference), OPTIONS
    none = measured(tree, *timed(lambda: refined(source, reference, options)))
    for budget in BUDGETS:
        even = uniform(source, budget)
        limit = len(even.mesh.faces)
        made: dict[str, Callable[[], Mesh]] = {
            "uniform": lambda even=even: refined(even.mesh, reference, options),
            "uniform, swapped": lambda even=even: swapped(even, reference, tree, options),
            **in_detail(source, reference, {"max_faces": limit}),
        }
        found = {name: measured(tree, *timed(make)) for name, make in made.items()}
        last = measured(tree, decimated(reference, limit), 0.0)
        yield budget, {"none": none, **found, "decimated": last}


def in_detail(
    source: Mesh, reference: Mesh, asked: dict[str, Any]
) -> dict[str, Callable[[], Mesh]]:
    """Ways to add as many faces as the options ask for."""
    whole, across = Charts.alone(source.faces), asked | {"flips": "chart"}
    return {
        "detail": lambda: detailed(source, reference, asked),
        "detail, one chart": lambda: detailed(source, reference, across, whole),
        "detail, charts": lambda: detailed(source, reference, across, projected(source)),
    }


def within(source: Mesh, reference: Mesh) -> dict[str, Result]:
    """Give a source what a tolerance takes: samples within three times that of the 95th share."""
    tree, asked = SurfaceTree(reference), {"growth": 8.0, "tolerance": 3 * TOLERANCE}
    made: dict[str, Callable[[], Mesh]] = {
        "none": lambda: refined(source, reference, OPTIONS),
        **in_detail(source, reference, asked),
    }
    return {name: measured(tree, *timed(make)) for name, make in made.items()}


def uniform(source: Mesh, budget: int) -> DividedMesh:
    """Every face in four; for fewer, the largest faces first, at their longest side."""
    divided = DividedMesh.of(source)
    every = np.ones(len(source.edges), dtype=bool)
    if budget == 4:
        return divided.split(every)
    equal = np.ones((len(source.faces), 3))
    by_area = Misses(source.face_areas, equal, mean=1.0, farthest=1.0)
    once = np.ones(len(source.faces), dtype=np.int64)
    return divided.split(choose_edges(source, by_area, every, budget * len(source.faces), once))


def refined(mesh: Mesh, reference: Mesh, options: Options) -> Mesh:
    """Refine; where that is worse somewhere, keep it all the same: where it leads is compared."""
    answers = (refine_surface(mesh, reference, options, guarded=g) for g in (True, False))
    return mesh.moved_to(next(each for each in answers if not each.kept_input).positions)


def swapped(divided: DividedMesh, reference: Mesh, tree: SurfaceTree, options: Options) -> Mesh:
    """Refine, swap diagonals inside the faces of the source, and refine from there."""
    moved = divided.moved_to(refined(divided.mesh, reference, options).vertices)
    return refined(flip_inside(moved, tree).mesh, reference, options)


def detailed(
    source: Mesh, reference: Mesh, detail: dict[str, Any], charts: Charts | None = None
) -> Mesh:
    """Add faces as the engine does, and refine the divided source from where that ended."""
    asked = OPTIONS.model_copy(update={"detail": OPTIONS.detail.model_copy(update=detail)})
    every = np.ones(len(source.faces), dtype=bool)
    found = find_detail(source, reference, every, asked, charts=charts)
    table = found.subdivision.over(source.faces, len(source.vertices))
    points = np.concatenate([source.vertices, table.interpolated(source.vertices)])
    start = points.copy()
    start[table.faces.ravel()] = found.corners.reshape(-1, 3)
    divided = Mesh(points, table.faces)

    def solved(start: Floats | None) -> Mesh:
        answers = (
            SurfaceRefiner(
                SurfaceProblems(divided, reference, OPTIONS, start=start), guarded=guarded
            ).run()
            for guarded in (True, False)
        )
        return divided.moved_to(next(a for a in answers if not a.kept_input).positions)

    first = solved(start)
    tangles = new_tangles(divided, first.vertices, _MOST_PAIRS)
    if not are_many(tangles, len(divided.faces)):
        return first
    other = solved(None)
    return other if new_tangles(divided, other.vertices, _MOST_PAIRS) < tangles else first


def projected(mesh: Mesh) -> Charts:
    """Charts of texture coordinates: faces are projected along the axis that they face most."""
    axes = np.abs(mesh.face_normals).argmax(axis=1)
    sides = 2 * axes + (np.take_along_axis(mesh.face_normals, axes[:, None], 1)[:, 0] < 0)
    plane = np.stack([(axes + 1) % 3, (axes + 2) % 3], axis=1)
    places = np.take_along_axis(mesh.corners, plane[:, None, :], axis=2)
    whole = np.zeros(len(mesh.faces), dtype=np.int64)
    return Charts(6 * mesh.faces + sides[:, None], whole, (places,))


def decimated(mesh: Mesh, faces: int) -> Mesh:
    """Collapse edges by quadrics until about so many faces are left."""
    if faces >= len(mesh.faces):
        return mesh
    points, triangles = fast_simplification.simplify(
        mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32), target_count=faces, agg=5
    )
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    used, numbers = np.unique(triangles, return_inverse=True)
    return Mesh(points[used].astype(np.float64), numbers.reshape(-1, 3))


def timed(make: Callable[[], Mesh]) -> tuple[Mesh, float]:
    """A mesh and the processor seconds that it took."""
    started = time.process_time()
    return make(), time.process_time() - started


def measured(tree: SurfaceTree, mesh: Mesh, seconds: float) -> Result:
    """Hold a mesh against the reference, by samples that the engine does not draw."""
    reference = tree.mesh
    here, there = sample_surface(mesh, _SAMPLES, 1011), sample_surface(reference, _SAMPLES, 1012)
    own = SurfaceTree(mesh)
    forth, back = tree.closest(here.points), own.closest(there.points)
    corners = tree.closest(mesh.vertices[mesh.used_vertices]).distances.max()
    others = own.closest(reference.vertices[reference.used_vertices]).distances.max()
    cosines = [
        np.abs(row_dot(here.normals, reference.face_normals[forth.faces])).mean(),
        np.abs(row_dot(there.normals, mesh.face_normals[back.faces])).mean(),
    ]
    surfaces = [SampledSurface(each, _SAMPLING, 1) for each in (mesh, reference)]
    proven = prove_deviation(*surfaces, Frame.of(reference), OPTIONS.deviation, Bars())
    sampled = np.concatenate([forth.distances, back.distances])
    return Result(
        mean=float((forth.distances.mean() + back.distances.mean()) / 2),
        p95=float(np.quantile(sampled, 0.95)),
        farthest=float(max(sampled.max(), corners, others)),
        proven=proven.record.max.upper,
        normals=float(np.mean(cosines)),
        aspect=aspect_ratio(mesh).median,
        faces=len(mesh.faces),
        crossing=count_self_intersections(mesh, _MOST_PAIRS) or 0,
        seconds=seconds,
    )


def row(name: str, results: dict[str, Result]) -> str:
    """One pair at one budget: the mean as a ratio to uniform, and crossings."""
    base = results["uniform"]
    ratios = (f"{method} {results[method].mean / base.mean:.2f}" for method in METHODS)
    crossing = "/".join(str(results[method].crossing) for method in METHODS)
    return f"{name:44} {base.faces:6} faces  {'  '.join(ratios)}  crossing {crossing}"


def summary(budget: int, pairs: list[dict[str, Result]]) -> Table:
    """Means over all pairs, of ratios to uniform subdivision where a number is a distance."""
    table = Table(title=f"{budget} times the faces, {len(pairs)} pairs")
    columns = ("mean", "worst mean", "p95", "max", "proven max", "normals", "aspect", "faces")
    for column in ("", *columns, "crossing", "s"):
        table.add_column(column, justify="right" if column else "left")
    for method in METHODS:
        mine, base = ([pair[each] for pair in pairs] for each in (method, "uniform"))
        means = [a.mean / b.mean for a, b in zip(mine, base, strict=True)]
        table.add_row(
            method,
            f"{mean(means):.2f}",
            f"{max(means):.2f}",
            f"{mean(a.p95 / b.p95 for a, b in zip(mine, base, strict=True)):.2f}",
            f"{mean(a.farthest / b.farthest for a, b in zip(mine, base, strict=True)):.2f}",
            f"{mean(a.proven / b.proven for a, b in zip(mine, base, strict=True)):.2f}",
            f"{mean(each.normals for each in mine):.4f}",
            f"{mean(each.aspect for each in mine):.2f}",
            f"{mean(each.faces for each in mine):,.0f}",
            f"{sum(each.crossing for each in mine):,}",
            f"{mean(each.seconds for each in mine):.1f}",
        )
    return table


def of_tolerance(pairs: list[dict[str, Result]]) -> Table:
    """How many pairs a tolerance is reached for, with how many faces; of those, the means."""
    table = Table(title=f"p95 ≤ {TOLERANCE}, at most 8 times the faces, {len(pairs)} pairs")
    for column in ("", "reached", "p95", "times the faces", "crossing", "s"):
        table.add_column(column, justify="right" if column else "left")
    for method in WITHIN:
        mine = [pair[method] for pair in pairs]
        growth = [pair[method].faces / pair["source"].faces for pair in pairs]
        table.add_row(
            method,
            f"{sum(each.p95 <= TOLERANCE for each in mine)}",
            f"{mean(each.p95 for each in mine):.5f}",
            f"{mean(growth):.1f}",
            f"{sum(each.crossing for each in mine):,}",
            f"{mean(each.seconds for each in mine):.1f}",
        )
    return table


if __name__ == "__main__":
    main()
