"""Every mesh the paper's tables compare, made from one reference, each once.

A mesh is kept in a file with what making it cost, so that a run that is interrupted goes on
where it was.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from degradations import marching_cubes, missing_library
from paper_inputs import deformed, has_poisson, own_sphere, poisson, same_size_sphere
from paper_program import DEFAULT, solve_as_written

from meshcone.options import Options, parse_options
from meshcone.program.paper import refine_centroid
from meshcone.program.rounds import refine_surface
from meshcone.quality.baselines import project, smooth
from meshcone.surface import Mesh, SurfaceTree

# SCS asked about the answer would move nothing.
_EFFORTS = {
    name: parse_options({"effort": effort, "solver": {"certify": False}})
    for name, effort in (("surface", "fast"), ("best", "best"))
}

INPUTS = {"same": "sphere_same", "own": "sphere_own", "cubes": "marching_cubes"}


@dataclass(frozen=True)
class Made:
    """A mesh and what making it cost: ``seconds`` of processor time, and what its maker says."""

    mesh: Mesh
    record: dict[str, float]


class PaperMeshes:
    """The meshes of one reference, by name.

    Names are ``target``, those of :data:`INPUTS`, ``poisson``, and METHOD_INPUT for what a
    method makes of an input: paper, reduced (the paper's program in this engine's form),
    surface and best (the surface program at either effort), laplacian or projection.
    """

    def __init__(self, target: Mesh, directory: Path | None) -> None:
        """Name the reference, and where its meshes are kept, if they are."""
        self._target, self._directory = target, directory
        self._made: dict[str, Made] = {}

    def __getitem__(self, name: str) -> Made:
        if name not in self._made:
            self._made[name] = self._stored(name) or self._make_and_store(name)
        return self._made[name]

    def _make_and_store(self, name: str) -> Made:
        made = self._make(name)
        if self._directory is not None and name != "target":
            self._directory.mkdir(parents=True, exist_ok=True)
            np.savez(
                self._directory / f"{name}.npz",
                vertices=made.mesh.vertices,
                faces=made.mesh.faces,
                record=json.dumps(made.record),
            )
        return made

    def _stored(self, name: str) -> Made | None:
        path = self._directory and self._directory / f"{name}.npz"
        if not path or not path.exists():
            return None
        with np.load(path) as stored:
            mesh = Mesh(stored["vertices"], stored["faces"])
            return Made(mesh, json.loads(str(stored["record"])))

    def _make(self, name: str) -> Made:
        if name == "target":
            return Made(self._target, {})
        simple: dict[str, Callable[[], Mesh]] = {
            "sphere_same": lambda: deformed(same_size_sphere(self._target), self._target),
            "sphere_own": lambda: deformed(own_sphere(self._target), self._target),
            "marching_cubes": lambda: marching_cubes(self._target),
            "poisson": lambda: poisson(self._target),
        }
        if name in simple:
            return _timed(simple[name])
        method, _, of = name.partition("_")
        source = self[INPUTS[of]].mesh
        if method == "paper":
            solve = solve_as_written(source, self._target)
            return Made(solve.mesh, solve.record)
        if method == "reduced":
            return _reduced(source, self._target)
        if method in _EFFORTS:
            return _timed(lambda: _refined(source, self._target, _EFFORTS[method]))
        refine: dict[str, Callable[[], Mesh]] = {
            "laplacian": lambda: smooth(source),
            "projection": lambda: project(source, SurfaceTree(self._target)),
        }
        return _timed(refine[method])


def unavailable(name: str) -> bool:
    """Whether a mesh needs a library of the ``bench`` extra that is not installed."""
    if name == "poisson":
        return not has_poisson()
    if name == "marching_cubes" or name.endswith("_cubes"):
        return missing_library("marching_cubes") is not None
    return False


def _reduced(source: Mesh, target: Mesh) -> Made:
    started = time.process_time()
    answer = refine_centroid(source, target, DEFAULT.options)
    info = answer.rounds[0].info
    assert info is not None
    record = {
        "seconds": time.process_time() - started,
        "iterations": info.iterations,
        "solved": float(info.solved),
    }
    return Made(source.moved_to(answer.positions), record)


def _refined(source: Mesh, target: Mesh, options: Options) -> Mesh:
    # What the program makes is compared, whether or not it would be returned.
    answer = refine_surface(source, target, options, guarded=False)
    return source.moved_to(answer.positions)


def _timed(make: Callable[[], Mesh]) -> Made:
    started = time.process_time()
    mesh = make()
    return Made(mesh, {"seconds": time.process_time() - started})
