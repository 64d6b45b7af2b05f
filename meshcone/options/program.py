"""The cone program: its two formulations, and how it is solved."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, WithJsonSchema

from meshcone.options.section import Section, Weight, WeightOrNone

# An enumeration of one word: to generators of clients a constant is the only alternative.
_Auto = Annotated[Literal["auto"], WithJsonSchema({"type": "string", "enum": ["auto"]})]


class CentroidOptions(Section):
    """The paper's program (section "Mathematical Formulation")."""

    regularization: Weight = Field(0.01, description="Tikhonov weight λ")
    edge_cap: Weight = Field(0.5, description="cap δ on every edge's length")
    samples: int = Field(
        10_000, ge=1, le=1_000_000, description="reference samples for the centroid μ"
    )
    form: Literal["reduced", "cvxpy"] = Field(
        "reduced",
        description="reduced: positions only, handed straight to SCS; "
        "cvxpy: the model as the paper wrote it",
    )


class SurfaceOptions(Section):
    """The surface program: distances to the reference's surface, both ways."""

    fairness: tuple[WeightOrNone, ...] = Field(
        (3.0, 1.0, 0.3, 0.05, 0.01),
        max_length=50,
        description="weight of the Laplacian in each round; its length is the number of rounds, "
        "and without any the source is returned as it was",
    )
    tangential: Weight = Field(
        0.1, description="weight of tangential against normal distance to the reference"
    )
    proximity: Weight = Field(0.01, description="weight on the distance to the previous round")
    reverse: WeightOrNone = Field(
        3.0, description="weight of reference samples pulled from the moving source"
    )
    noise_scale: Weight = Field(
        0.5, description="noise over edge length at which the fairness acts in full"
    )
    reverse_from: int = Field(
        1, ge=0, le=1000, description="first round, counted from 0, in which reference samples pull"
    )
    faces: WeightOrNone = Field(
        3.0,
        description="weight of samples of the source's faces pulled to the reference, and of "
        "reference samples in the same rounds; 0: no round has them",
    )
    faces_from: int = Field(
        3,
        ge=0,
        le=1000,
        description="first round, counted from 0, in which samples of the source's faces pull",
    )
    guards: int = Field(
        3,
        ge=0,
        le=20,
        description="rounds after the schedule, with effort best, that mend faces which pass "
        "through others or turn their backs on the reference, where it comes to that; 0: none",
    )
    reach: Weight = Field(
        4.0,
        description="how far from the source a reference sample may lie and still pull, in "
        "medians of the source's own distance",
    )
    fairness_knee: Weight = Field(
        3.0,
        description="fairness above this acts in full only where the noise exceeds the "
        "edges by as much",
    )
    regions: Annotated[int, Field(ge=1, le=4096)] | _Auto = Field(
        1,
        description="overlapping regions of the source whose programs are solved apart, one after "
        "the other or in processes of their own, before the whole one is finished; auto: as many "
        "as leave none with more than 250,000 vertices",
    )
    edge_cap: float = Field(
        4.0,
        ge=1.0,
        le=1e6,
        allow_inf_nan=False,
        description="cap on each edge, as a multiple of the longest input edge at either end "
        "or of the mean one, whichever is longer",
    )


class SolverOptions(Section):
    """How a round's program is solved, and the settings of SCS."""

    method: Literal["active", "full"] = Field(
        "active",
        description="active: the relaxation, then only the cones it violates; "
        "full: every cone to SCS at once",
    )
    certify: bool = Field(True, description="have SCS confirm the last round's optimum")
    certify_limit: int = Field(
        100_000,
        ge=0,
        le=1_000_000_000,
        description="vertices above which SCS is not asked to confirm",
    )
    tolerance: float = Field(
        1e-5,
        ge=1e-9,
        le=0.1,
        allow_inf_nan=False,
        description="what no residual of the certificate may exceed; also SCS's tolerance",
    )
    max_iterations: int = Field(1000, ge=1, le=1_000_000, description="iterations per solve")
    linear_solver: Literal["auto", "qdldl", "mkl", "cpu_indirect"] = Field(
        "auto", description="linear system solver inside SCS"
    )
    time_limit: float = Field(
        0.0,
        ge=0,
        le=1e6,
        allow_inf_nan=False,
        description="seconds for alignment, all rounds and confirmation together; 0: no limit",
    )
