"""What is reported of every solve: sizes, the solver's account of the run, its history."""

from __future__ import annotations

from typing import Literal

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
    method: Literal["relaxation", "multipliers", "scs"] = Field(
        description="relaxation: no cone was violated without any, so none is active; "
        "multipliers: the dual method on the violated cones; scs: SCS"
    )
    passes: int = Field(description="selections of violated cones it took")
    seconds: float = Field(description="data and solution of this round, without SCS confirming")
    sizes: ProgramSizes | None = Field(
        None, description="of the program SCS solved or confirmed; absent where it was not asked"
    )
    info: SolveRecord | None = Field(
        None, description="SCS's account of solving or confirming; absent where it was not asked"
    )
    active_cones: dict[str, int] = Field(description="cones with a multiplier, by kind")
    largest_violation: float = Field(
        description="how far the worst cone is exceeded, relative to the reference's radius"
    )
    movement: float = Field(description="root mean square distance moved in this round")
    history: dict[str, list[float]] = Field(
        default_factory=dict,
        description="residuals, objectives and seconds at each iteration of SCS",
    )


class RegionsRecord(_Record):
    """Overlapping regions of the source whose programs were solved apart."""

    count: int = Field(description="how many there were")
    vertices: list[int] = Field(description="vertices of each region")
    solved_for: list[int] = Field(
        description="vertices each region solved for: its own and those around it"
    )
    overlap: int = Field(description="rings of edges by which a region reaches beyond its own")
    rounds: int = Field(description="rounds there were")
    rounds_together: int = Field(
        description="rounds finished as one program: the last, and those in which a chain of "
        "tight cones leads out of a region"
    )
    products_together: int = Field(
        description="products with the whole program's matrix which that took"
    )


class SolverReport(_Record):
    """All rounds of one refinement."""

    formulation: str = Field(description="surface or centroid")
    form: str = Field(description="reduced or cvxpy")
    effort: str = Field(description="fast or best")
    candidate: str = Field(description="which of the settings tried was kept")
    solved: bool = Field(description="whether every round was solved to its tolerance")
    confirmed: bool = Field(description="whether SCS confirmed the last round's optimum")
    iterations: int = Field(description="of SCS, in all rounds together")
    confirm_seconds: float = Field(description="spent on SCS confirming the last round")
    rounds: list[RoundRecord]
    regions: RegionsRecord | None = Field(
        None, description="how the source was divided to be solved; absent where it was not"
    )


class Residuals(_Record):
    """How far a point is from optimal; zero is a proof."""

    primal: float = Field(
        description="largest violation over all cones, relative to the reference's radius"
    )
    dual: float = Field(
        description="‖P x + c + Aᵀy‖∞ or the distance of y from K*, whichever is larger, "
        "relative to 1 + max(‖P x‖∞, ‖c‖∞, ‖Aᵀy‖∞)"
    )
    gap: float = Field(
        description="|xᵀP x + cᵀx + bᵀy| relative to 1 plus the largest of its terms"
    )
    complementarity: float = Field(
        description="largest distance between a cone that has a multiplier and its bound, "
        "|yᵀs|/‖y‖, relative to the reference's radius"
    )

    @property
    def worst(self) -> float:
        """The largest of them."""
        return max(self.primal, self.dual, self.gap, self.complementarity)
