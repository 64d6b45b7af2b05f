"""The methods compared: this engine, and what one would use without it."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from types import FrameType
from typing import Any

import numpy as np
import trimesh
from degradations import smoothed

from meshcone.options import parse_options
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats

_STEPS = 10
# Taubin, "A signal processing approach to fair surface design" (1995): pass band 0.1.
_SHRINK, _INFLATE = 0.5, -0.53
NRICP_LARGEST, NRICP_SECONDS = 5000, 60.0


class SkippedError(Exception):
    """A method was not run; the message says why."""


@dataclass(frozen=True)
class Pair:
    """A mesh to refine and its reference, both in the reference's frame.

    Attributes:
        source, reference: the meshes.
        tree: closest points on the reference.
    """

    source: Mesh
    reference: Mesh
    tree: SurfaceTree


Method = Callable[[Pair], Floats]


def engine(options: dict[str, Any], pair: Pair) -> Floats:
    """This engine, with the given options."""
    from meshcone.program.rounds import refine_surface

    return refine_surface(pair.source, pair.reference, parse_options(options)).positions


def projection(pair: Pair) -> Floats:
    """Every vertex at its closest point of the reference."""
    return pair.tree.closest(pair.source.vertices).points


def laplacian(pair: Pair) -> Floats:
    """Ten half steps towards the mean of the neighbours; the reference is not looked at."""
    return smoothed(pair.source, [_SHRINK] * _STEPS)


def taubin(pair: Pair) -> Floats:
    """Ten pairs of shrinking and inflating steps; the reference is not looked at."""
    return smoothed(pair.source, [_SHRINK, _INFLATE] * _STEPS)


def nricp_amberg(pair: Pair) -> Floats:
    """Non-rigid registration as trimesh has it, at its defaults.

    Raises:
        SkippedError: the mesh is large, time ran out, or a library it needs is missing.
    """
    if find_spec("rtree") is None:
        raise SkippedError("needs rtree, of the bench extra")
    if len(pair.source.vertices) > NRICP_LARGEST:
        raise SkippedError(f"more than {NRICP_LARGEST} vertices")
    source, target = (
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        for mesh in (pair.source, pair.reference)
    )
    with _time_limit(NRICP_SECONDS):
        return np.asarray(trimesh.registration.nricp_amberg(source, target))


PEERS: dict[str, Method] = {
    "projection": projection,
    "laplacian": laplacian,
    "taubin": taubin,
    "nricp": nricp_amberg,
}


def engine_methods(efforts: list[str]) -> dict[str, Method]:
    """This engine at each effort, without the confirmation by SCS, which moves nothing."""
    return {
        effort: partial(engine, {"effort": effort, "solver": {"certify": False}})
        for effort in efforts
    }


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    def give_up(_signal: int, _frame: FrameType | None) -> None:
        raise SkippedError(f"not finished after {seconds:g} s")

    previous = signal.signal(signal.SIGALRM, give_up)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
