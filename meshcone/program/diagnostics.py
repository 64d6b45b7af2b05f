"""What is reported of every solve: sizes, the solver's account of the run, its history."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ProgramSizes(_Record):
    """Dimensions of the program as the solver saw it."""

    variables: int = Field(description="columns of A")
    constraints: int = Field(description="rows of A")
    zero: int = Field(description="rows in the zero cone")
    linear: int = Field(description="rows in the non-negative cone")
    second_order: int = Field(description="rows in second-order cones")
    cones: dict[str, int] = Field(description="number of cones of each kind")
    nnz_A: int = Field(description="non-zeros of A")
    nnz_P: int = Field(description="non-zeros of P, upper triangle")


class SolveRecord(_Record):
    """SCS's own account; residuals are absolute, in the infinity norm."""

    status: str
    solved: bool = Field(description="whether both tolerances were met")
    iterations: int
    primal_residual: float
    dual_residual: float
    gap: float
    primal_objective: float
    dual_objective: float
    linear_solver: str = Field(description="linear system solver inside SCS")
    setup_seconds: float
    solve_seconds: float


class RoundRecord(_Record):
    """One convex program of the refinement."""

    round: int = Field(description="counted from 1")
    sizes: ProgramSizes
    info: SolveRecord
    active_cones: dict[str, int] = Field(description="cones with a multiplier, by kind")
    largest_violation: float = Field(
        description="how far the worst cone is exceeded, relative to the reference's radius"
    )
    movement: float = Field(description="root mean square distance moved in this round")
    history: dict[str, list[float]] = Field(
        description="residuals, objectives and seconds at each iteration"
    )


class SolverReport(_Record):
    """All rounds of one refinement."""

    formulation: str
    form: str = Field(description="reduced or cvxpy")
    solved: bool = Field(description="whether every round met the tolerance")
    iterations: int = Field(description="in all rounds together")
    rounds: list[RoundRecord]
