"""Proven deviations beside sampled ones, what they cost, and whether any sample contradicts them.

    OMP_NUM_THREADS=1 python benchmarks/deviation.py [--data DIRECTORY] [--all] [--dense N]

Each shape is damaged in several ways, or damaged and refined, and compared with itself as it was,
both ways. A row has the interval, relative to the radius; processor seconds; the pieces made; what
a certificate stores of them; and the largest distance of 5,000 and 100,000 samples, as shares of
the proven upper end. N points more (200,000) are then drawn on each surface: none may be farther
than the upper end, which ends the benchmark with an error. The second table is of pairs that are
hard for a search, or for samples; the last has a row for each damage.
"""

from __future__ import annotations

import argparse
import io
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from reference_shapes import Shape, bumpy_torus, made_shapes, sphere, stored_shapes
from rich.console import Console
from rich.table import Table

from meshcone.options import DeviationOptions, parse_options
from meshcone.program.rounds import refine_surface
from meshcone.quality.deviation.check import check_leaves
from meshcone.quality.deviation.interval import Asked, Interval, directed_deviation
from meshcone.surface import Mesh, SurfaceTree, sample_surface

_VERTICES, _LARGE = 10_000, 200_000
_SAMPLES = (5_000, 100_000)
_ROUNDING = 1e-9

Pair = tuple[Mesh, Mesh]


@dataclass(frozen=True)
class Row:
    """One direction of one pair.

    Attributes:
        seconds: processor seconds of the search.
        checked: processor seconds of proving the upper end again from its leaves.
        stored: bytes that a certificate takes for the leaves.
        sampled: largest distance of as many samples, as a share of the upper end.
    """

    name: str
    damage: str
    faces: int
    found: Interval
    seconds: float
    checked: float
    stored: int
    sampled: tuple[float, ...]


def main() -> None:
    """Measure all pairs and print both tables."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--data", type=Path, help="a directory with objects/ and scans/")
    arguments.add_argument("--all", action="store_true", help="every shape of it, not every eighth")
    arguments.add_argument("--dense", type=int, default=200_000, help="points drawn to contradict")
    given = arguments.parse_args()
    shapes = made_shapes(_VERTICES)
    if given.data is not None:
        shapes += stored_shapes(given.data, small=not given.all)
    rows = [row for shape in shapes for row in _of_shape(shape, given.dense)]
    _print("damaged shapes", rows)
    _print("hard pairs", list(_hard(given.dense)))
    _print_damages(rows)


def _of_shape(shape: Shape, dense: int) -> Iterator[Row]:
    reference = shape.load()
    for damage, damaged in DAMAGES.items():
        yield from _both_ways(shape.name, damage, (damaged(reference), reference), dense)


def _both_ways(name: str, damage: str, pair: Pair, dense: int) -> Iterator[Row]:
    mesh, reference = pair
    print(name, damage, file=sys.stderr, flush=True)
    yield _measured(name, f"{damage} →", mesh, reference, dense)
    yield _measured(name, f"{damage} ←", reference, mesh, dense)


def _measured(name: str, damage: str, mesh: Mesh, reference: Mesh, dense: int) -> Row:
    chosen = DeviationOptions()
    started = time.process_time()
    asked = Asked(chosen.width, chosen.share, chosen.pieces)
    found = directed_deviation(mesh, reference, asked)
    seconds = time.process_time() - started
    started = time.process_time()
    again = check_leaves(mesh, reference, found.leaves)
    checked = time.process_time() - started
    tree = SurfaceTree(reference)
    sampled = tuple(_sampled(mesh, tree, count) / max(found.upper, 1e-300) for count in _SAMPLES)
    farthest = _sampled(mesh, tree, dense, seed=1)
    if max(farthest - found.upper, again - found.upper, found.lower - found.upper) > _ROUNDING:
        raise SystemExit(f"{name} {damage}: {farthest} or {again} is beyond {found}")
    packed = io.BytesIO()
    np.savez_compressed(packed, **found.leaves.arrays())
    return Row(name, damage, len(mesh.faces), found, seconds, checked, packed.tell(), sampled)


def _sampled(mesh: Mesh, tree: SurfaceTree, count: int, seed: int = 0) -> float:
    points = sample_surface(mesh, count, seed, "random").points
    return float(tree.closest(points).distances.max())


def _noisy(amount: float) -> Callable[[Mesh], Mesh]:
    def damaged(mesh: Mesh) -> Mesh:
        offsets = np.random.default_rng(0).normal(scale=amount, size=mesh.vertices.shape)
        return mesh.moved_to(mesh.vertices + offsets)

    return damaged


def _subdivided(mesh: Mesh) -> Mesh:
    sides = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    edges, which = np.unique(sides, axis=0, return_inverse=True)
    middles = mesh.vertices[edges].mean(axis=1)
    ab, bc, ca = (which.reshape(-1, 3) + len(mesh.vertices)).T
    a, b, c = mesh.faces.T
    faces = np.concatenate(
        [np.stack(face, axis=1) for face in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    )
    return Mesh(np.concatenate([mesh.vertices, middles]), faces)


def _decimated(mesh: Mesh) -> Mesh:
    import fast_simplification

    vertices, faces = fast_simplification.simplify(
        mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32), 0.75
    )
    return Mesh(vertices.astype(float), faces.astype(np.int64))


def _quantised(mesh: Mesh) -> Mesh:
    step = 2 / 4095
    return mesh.moved_to(np.round(mesh.vertices / step) * step)


def _refined(mesh: Mesh) -> Mesh:
    noisy = _noisy(0.02)(mesh)
    return mesh.moved_to(refine_surface(noisy, mesh, parse_options({"effort": "fast"})).positions)


DAMAGES: dict[str, Callable[[Mesh], Mesh]] = {
    "itself": lambda mesh: mesh.moved_to(mesh.vertices.copy()),
    "subdivided": _subdivided,
    "noise .5 %": _noisy(0.005),
    "noise 2 %": _noisy(0.02),
    "decimated to 25 %": _decimated,
    "quantised, 12 bits": _quantised,
    "noise 2 %, refined": _refined,
}


def _hard(dense: int) -> Iterator[Row]:
    ball, large = sphere(_VERTICES), bumpy_torus(_LARGE)
    spiked = ball.vertices.copy()
    spiked[77] *= 1.05
    foot = ball.vertices[500]
    fin = np.array([foot, 1.3 * foot, foot + 1e-5 * np.roll(foot, 1)])
    pairs: dict[str, Pair] = {
        "fold inside": (_with(ball, 0.98 * ball.corners[100]), ball),
        "spike between samples": (ball.moved_to(spiked), ball),
        "fin .3 long, 1e-5 wide": (_with(ball, fin), ball),
        "coplanar, other diagonals": (_plate(100), _plate(100, turned=True)),
        "coplanar, other grids": (_plate(70), _plate(83)),
        "plateau: sphere over sphere": (ball.moved_to(1.2 * ball.vertices), sphere(2_500)),
        "middle of two plates": (_plate(20, 0.1), _merged(_plate(20), _plate(21, 0.2))),
        "400,000 faces, noise": (_noisy(0.002)(large), large),
        "400,000 faces, decimated": (_decimated(large), large),
        "10,000 radii away": (ball.moved_to(ball.vertices + np.array([1e4, 0, 0])), ball),
    }
    for name, pair in pairs.items():
        yield from _both_ways(name, "", pair, dense)


def _with(mesh: Mesh, corners: np.ndarray) -> Mesh:
    return _merged(mesh, Mesh(corners, np.array([[0, 1, 2]])))


def _merged(first: Mesh, second: Mesh) -> Mesh:
    return Mesh(
        np.concatenate([first.vertices, second.vertices]),
        np.concatenate([first.faces, second.faces + len(first.vertices)]),
    )


def _plate(steps: int, height: float = 0.0, *, turned: bool = False) -> Mesh:
    side = np.linspace(-0.7, 0.7, steps + 1)
    vertices = np.array([(x, y, height) for x, y in product(side, side)])
    a = np.arange(steps * (steps + 1)).reshape(steps, -1)[:, :-1].ravel()
    b, c, d = a + 1, a + steps + 2, a + steps + 1
    halves = ((a, b, d), (b, c, d)) if turned else ((a, b, c), (a, c, d))
    return Mesh(vertices, np.concatenate([np.stack(half, axis=1) for half in halves]))


def _print(title: str, rows: list[Row]) -> None:
    table = Table(title=title)
    table.add_column("pair")
    headings = ("faces", "lower", "upper", "narrow", "cpu s", "check s", "pieces", "kB")
    for heading in (*headings, *(f"{count:,}" for count in _SAMPLES)):
        table.add_column(heading, justify="right")
    for row in rows:
        found = row.found
        table.add_row(
            f"{row.name} {row.damage}",
            f"{row.faces:,}",
            f"{found.lower:.3g}",
            f"{found.upper:.3g}",
            "yes" if found.answered else "no",
            f"{row.seconds:.2f}",
            f"{row.checked:.2f}",
            f"{found.pieces:,}",
            f"{row.stored / 1000:,.0f}",
            *(f"{share:.2f}" if found.upper > _ROUNDING else "" for share in row.sampled),
        )
    Console(width=150).print(table)


def _print_damages(rows: Iterable[Row]) -> None:
    table = Table(title="processor seconds a direction")
    table.add_column("damage")
    for heading in ("directions", "narrow", "median", "largest", "largest check", "largest kB"):
        table.add_column(heading, justify="right")
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(row.damage, []).append(row)
    for name, group in {**groups, "all": list(rows)}.items():
        seconds = [row.seconds for row in group]
        table.add_row(
            name,
            str(len(group)),
            str(sum(row.found.answered for row in group)),
            f"{np.median(seconds):.2f}",
            f"{max(seconds):.2f}",
            f"{max(row.checked for row in group):.2f}",
            f"{max(row.stored for row in group) / 1000:,.0f}",
        )
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
