"""The paper's program as it was written: a CVXPY model.

Kept as the independent statement of the program the reduced form is tested against,
and offered as ``centroid.form = "cvxpy"``.
"""

from __future__ import annotations

from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from meshcone.program.centroid import CentroidObjective
from meshcone.program.cones import EdgeCaps


@dataclass(frozen=True)
class CompiledSizes:
    """What a model compiles to, in the terms of the paper's table "SCS problem structure"."""

    variables: int
    constraints: int
    zero: int
    linear: int
    second_order: int
    cones: int
    nnz_A: int
    nnz_P: int


def centroid_model(objective: CentroidObjective, caps: EdgeCaps) -> tuple[cp.Problem, cp.Variable]:
    """State the centroid program; the second value is its variable X, (n, 3)."""
    X = cp.Variable(objective.anchor.shape, name="X")
    centred = X - np.broadcast_to(objective.centroid, objective.anchor.shape)
    cost = cp.sum_squares(centred) + objective.regularization * cp.sum_squares(X - objective.anchor)
    lengths = cp.norm(X[caps.vertices[:, 0]] - X[caps.vertices[:, 1]], 2, axis=1)
    return cp.Problem(cp.Minimize(cost), [lengths <= caps.caps]), X


def compiled_sizes(problem: cp.Problem) -> CompiledSizes:
    """Compile a model for SCS and count."""
    data, _, _ = problem.get_problem_data(cp.SCS)
    dims, A, P = data["dims"], data["A"], data["P"]
    return CompiledSizes(
        variables=A.shape[1],
        constraints=A.shape[0],
        zero=dims.zero,
        linear=dims.nonneg,
        second_order=sum(dims.soc),
        cones=len(dims.soc),
        nnz_A=A.nnz,
        nnz_P=P.nnz,
    )
