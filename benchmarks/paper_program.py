"""The paper's program as its authors ran it: the CVXPY model, SCS, a rescaled answer."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from meshcone.options import Options, parse_options
from meshcone.program.centroid import centroid_program
from meshcone.program.model import centroid_model
from meshcone.surface import Frame, Mesh

# Table "SCS problem structure" and section "Experiments".
_TOLERANCE, _ITERATIONS, _LINEAR_SOLVER = 1e-5, 1000, "qdldl"


@dataclass(frozen=True)
class Setting:
    """λ and δ; the defaults are those of the paper's main experiment."""

    regularization: float = 0.01
    edge_cap: float = 0.5

    @property
    def key(self) -> str:
        """A name for files and tables."""
        return f"{self.regularization:g}/{self.edge_cap:g}"

    @property
    def options(self) -> Options:
        """The same for the engine."""
        centroid = {"regularization": self.regularization, "edge_cap": self.edge_cap}
        return parse_options({"preset": "paper", "centroid": centroid})


DEFAULT = Setting()
LAMBDAS = [Setting(value, 0.5) for value in (0.001, 0.01, 0.1)]
DELTAS = [Setting(0.1, value) for value in (0.005, 0.05, 0.5)]
# Caps on a third of the edges cost ten times what the other settings do: a stage of its own.
TIGHT = DELTAS[0]
LOOSE = list(dict.fromkeys([*LAMBDAS, *DELTAS[1:]]))


@dataclass(frozen=True)
class Solve:
    """One solve of the model.

    Attributes:
        mesh: the answer, blown up about the centroid by (1 + λ)/λ.
        seconds: processor time from the meshes to the answer, CVXPY's compilation included.
        iterations: of SCS.
        solved: whether SCS met its tolerance.
        active: share of the edges whose cap the answer exhausts.
    """

    mesh: Mesh
    seconds: float
    iterations: int
    solved: bool
    active: float

    @property
    def record(self) -> dict[str, float]:
        """All but the mesh."""
        return {
            "seconds": self.seconds,
            "iterations": self.iterations,
            "solved": float(self.solved),
            "active": self.active,
        }


def solve_as_written(source: Mesh, reference: Mesh, setting: Setting = DEFAULT) -> Solve:
    """State the paper's program in CVXPY and solve it with the paper's settings of SCS."""
    started = time.process_time()
    objective, caps, _ = centroid_program(source, reference, setting.options)
    problem, X = centroid_model(objective, caps)
    with warnings.catch_warnings():
        # CVXPY warns of an answer at the iteration limit, which the record says.
        warnings.simplefilter("ignore", UserWarning)
        problem.solve(
            solver=cp.SCS,
            eps_abs=_TOLERANCE,
            eps_rel=_TOLERANCE,
            max_iters=_ITERATIONS,
            linear_solver=_LINEAR_SOLVER,
            warm_start=True,
        )
    optimum = np.asarray(X.value)
    seconds = time.process_time() - started
    lengths = source.moved_to(optimum).edge_lengths
    return Solve(
        mesh=source.moved_to(objective.undo_shrink(optimum)),
        seconds=seconds,
        iterations=int(problem.solver_stats.num_iters),
        solved=problem.status == cp.OPTIMAL,
        active=float(np.mean(lengths > setting.edge_cap * (1 - 1e-3))),
    )


def in_unit_sphere(mesh: Mesh) -> Mesh:
    """The mesh moved and scaled as the paper shows its results: "in a unit sphere"."""
    return mesh.moved_to(Frame.of(mesh).into(mesh.vertices))
