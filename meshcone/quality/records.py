"""The quality section of a report, as data."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PointToSurface(_Record):
    """Exact distances of samples of either surface to the other's triangles."""

    mean: float = Field(description="mean of the two directed means")
    rms: float = Field(description="root of the mean of the two directed mean squares")
    p95: float = Field(description="95th percentile over the samples of both directions")
    max: float = Field(description="largest distance in either direction")


class AspectRatio(_Record):
    """L_max · perimeter / (4√3 · area) over the faces with area; 1 is equilateral."""

    mean: float = Field(description="one sliver dominates it: read the median")
    median: float
    share_over_4: float = Field(description="share of faces above 4, or without area")


class Metrics(_Record):
    """One mesh against the reference; distances are relative to the reference's radius."""

    point_to_surface: PointToSurface
    chamfer: float = Field(description="mean squared distance to the nearest sample, summed")
    chamfer_l1: float = Field(description="mean distance to the nearest sample, summed")
    hausdorff: float = Field(description="largest distance to the nearest sample, either way")
    hausdorff95: float = Field(description="larger of the two directed 95th percentiles")
    normal_consistency: float = Field(description="mean |n·n'| with the nearest sample")
    surface_normal_consistency: float = Field(description="mean |n·n'| with the closest triangle")
    normal_deviation_deg: float = Field(
        description="mean angle between n and the closest triangle's normal, up to sign, degrees"
    )
    fscore: float = Field(description="harmonic mean of precision and recall within τ = 0.01")
    emd: float = Field(description="mean distance under the best one-to-one matching of samples")
    aspect_ratio: AspectRatio


class Validity(_Record):
    """Whether a mesh is a well-formed surface, on its welded vertices."""

    watertight: bool = Field(description="every edge has exactly two faces")
    boundary_edges: int = Field(description="edges with one face")
    non_manifold_edges: int = Field(description="edges with more than two faces")
    degenerate_faces: int = Field(description="faces without area")
    duplicate_faces: int = Field(description="faces with the same three vertices as an earlier one")
    components: int = Field(description="pieces connected by shared vertices")


class Conventions(_Record):
    """What the numbers mean: sampling behind every metric of this report."""

    samples: int
    emd_samples: int
    sampling: str
    seed: int
    distance_unit: str = "radius of the reference, see frame.radius for it in model units"
    chamfer: str = "mean d² A→B + mean d² B→A between samples (PyTorch3D)"
    emd: str = "exact minimum over bijections of the mean distance (linear assignment)"
    hausdorff: str = "between samples; point_to_surface.max is to the surface itself"
    normal_consistency: str = "½ (mean |n·n'| A→B + B→A), n' of the nearest sample"
    aspect_ratio: str = "L_max · perimeter / (4√3 · area)"
    floor: str = "the reference against itself, sampled twice in the same way"


class Quality(_Record):
    """The metric set of input, refined mesh and floor, under one sampling."""

    input: Metrics
    refined: Metrics | None = Field(None, description="absent where nothing was refined")
    floor: Metrics
    conventions: Conventions
