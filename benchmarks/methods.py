"""The methods compared: this engine, and what one would use without it."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
import trimesh
from degradations import smoothed
from descent import descended

from meshcone.options import parse_options
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats

_STEPS = 10
# Taubin, "A signal processing approach to fair surface design" (1995): pass band 0.1.
_SHRINK, _INFLATE = 0.5, -0.53
NRICP_LARGEST, NRICP_SECONDS = 5000, 30.0
_DESCENT_SEED = 40_000  # neither the engine's nor the measures'


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
    # In a process of its own: a factorisation that fills in heeds no signal.
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=_send_nricp, args=(sender, pair))
    child.start()
    sender.close()
    try:
        if not receiver.poll(NRICP_SECONDS):
            raise SkippedError(f"not finished after {NRICP_SECONDS:g} s")
        return np.asarray(receiver.recv())
    except EOFError:
        raise SkippedError("trimesh raised an exception") from None
    finally:
        child.kill()
        child.join()


def _send_nricp(sender: Connection, pair: Pair) -> None:
    source, target = (
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        for mesh in (pair.source, pair.reference)
    )
    sender.send(np.asarray(trimesh.registration.nricp_amberg(source, target)))


def lbfgs(pair: Pair) -> Floats:
    """The mean distance brought down by L-BFGS, whatever becomes of the faces.

    It begins at this engine's answer and at the input; the better end counts.
    """
    answer = engine({"effort": "best", "solver": {"certify": False}}, pair)
    starts = pair.source.moved_to(answer), pair.source
    ends = [descended(mesh, pair.reference, pair.tree, _DESCENT_SEED) for mesh in starts]
    return min(ends, key=lambda end: end[0])[1]


PEERS: dict[str, Method] = {
    "projection": projection,
    "laplacian": laplacian,
    "taubin": taubin,
    "nricp": nricp_amberg,
}
# How close one can come at all; each takes a minute a pair.
BOUNDS: dict[str, Method] = {"lbfgs": lbfgs}


def engine_methods(efforts: list[str]) -> dict[str, Method]:
    """This engine at each effort, without the confirmation by SCS, which moves nothing."""
    return {
        effort: partial(engine, {"effort": effort, "solver": {"certify": False}})
        for effort in efforts
    }
