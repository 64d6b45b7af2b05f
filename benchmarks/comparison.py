"""Every method on one degraded shape."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from degradations import degraded
from measures import Measures, Yardstick, usable
from methods import Method, Pair, SkippedError
from reference_shapes import Shape

from meshcone.errors import MeshConeError


@dataclass(frozen=True)
class Row:
    """One method on one degraded shape.

    Attributes:
        vertices, faces: of the degraded mesh.
        before, after, reference_aspect_ratio: measures; ``after`` is None without a result.
        flipped: faces the method turned against the reference.
        crossings: pairs of faces that pass through each other and did not before; None where
            there are too many to test.
        harm: in what the result is worse than the input, by the rule the engine itself follows.
        seconds: the method alone.
        trouble: why there is no result.
        failed: whether that is the method's fault, and not a limit set here.
    """

    shape: str
    degradation: str
    method: str
    vertices: int
    faces: int
    before: Measures
    reference_aspect_ratio: float
    after: Measures | None = None
    flipped: int = 0
    crossings: int | None = 0
    harm: tuple[str, ...] = ()
    seconds: float = 0.0
    trouble: str = ""
    failed: bool = False

    @property
    def ratio(self) -> float:
        """Point-to-surface distance after over before; NaN without a result."""
        if self.after is None:
            return np.nan
        return self.after.point_to_surface / max(self.before.point_to_surface, 1e-300)

    @property
    def returned(self) -> bool:
        """Whether the result is the input."""
        return self.after == self.before

    @property
    def aspect_change(self) -> float:
        """Median aspect ratio over the input's; NaN without a result."""
        return np.nan if self.after is None else self.after.aspect_ratio / self.before.aspect_ratio

    @property
    def aspect_excess(self) -> float:
        """Median aspect ratio over the larger of the input's and the reference's own."""
        if self.after is None:
            return np.nan
        return self.after.aspect_ratio / max(self.before.aspect_ratio, self.reference_aspect_ratio)

    def beats(self, other: Row) -> bool:
        """Whether this result is nearer to the reference and has better normals, both."""
        if self.after is None or other.after is None:
            return False
        nearer = self.after.point_to_surface < other.after.point_to_surface
        return nearer and self.after.normals > other.after.normals


def compare_methods(
    shape: Shape, degradation: str, methods: Mapping[str, Method], cache: Path | None
) -> list[Row]:
    """Degrade a shape and run every method on it."""
    reference = shape.load()
    source = degraded(reference, degradation, cache)
    yardstick = Yardstick(reference)
    pair = Pair(source, reference, yardstick.tree)
    blank = Row(
        shape=shape.name,
        degradation=degradation,
        method="",
        vertices=len(source.vertices),
        faces=len(source.faces),
        before=yardstick.measure(source),
        reference_aspect_ratio=yardstick.aspect_ratio,
    )
    return [
        run_method(method, pair, yardstick, replace(blank, method=name))
        for name, method in methods.items()
    ]


def run_method(method: Method, pair: Pair, yardstick: Yardstick, blank: Row) -> Row:
    """Run one method and fill in its row."""
    start = time.perf_counter()
    try:
        positions = method(pair)
    except (SkippedError, MeshConeError) as error:
        return replace(blank, trouble=str(error), failed=isinstance(error, MeshConeError))
    seconds = time.perf_counter() - start
    after = pair.source.moved_to(positions)
    if not usable(after):
        return replace(blank, seconds=seconds, trouble="not finite, or no area", failed=True)
    return replace(
        blank,
        after=yardstick.measure(after),
        flipped=yardstick.flipped(pair.source, after),
        crossings=yardstick.crossings(pair.source, after),
        harm=yardstick.harm(pair.source, after),
        seconds=seconds,
    )
