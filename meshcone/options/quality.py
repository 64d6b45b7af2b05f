"""How the metrics are sampled."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from meshcone.options.section import Section


class QualityOptions(Section):
    """How the metrics are sampled."""

    sampling: Literal["sobol", "random"] = Field(
        "sobol",
        description="sobol: a scrambled low-discrepancy sequence; random: independent draws",
    )
    samples: int = Field(5000, ge=16, le=200_000, description="samples per surface")
    emd_samples: int = Field(
        1024, ge=16, le=5000, description="samples per surface for the exact earth mover's distance"
    )
    curvature_samples: int = Field(
        512,
        ge=16,
        le=20_000,
        description="samples per surface for the curvature error, of the others",
    )
    bound: float | None = Field(
        None,
        ge=1e-9,
        le=1e6,
        description="a distance, relative to the radius: quality.directions states the share of "
        "the area that is farther",
    )
    per: Literal["node", "mesh", "material", "group"] | None = Field(
        None, description="state distances of each node, mesh, material or group too"
    )
    intersection_pairs: int = Field(
        5_000_000,
        ge=0,
        le=100_000_000,
        description="pairs of faces that may be tested for self-intersections, some "
        "seconds for ten million; a mesh that has more is not tested",
    )
    appearance: bool = Field(
        True,
        description="compare colours and draw pictures in colour, where the files have any: some "
        "tenths of a second each",
    )
