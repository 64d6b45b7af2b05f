"""The quality section of a report, as data."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

Unit = Literal["radius", "radius²", "1/radius", "degrees", "ΔE00", "1", "count"]


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PointToSurface(_Record):
    """Exact distances of points of either surface to the other's triangles."""

    mean: float = Field(description="mean of the two directed means")
    rms: float = Field(description="root of the mean of the two directed mean squares")
    p95: float = Field(description="95th percentile over the samples of both directions")
    max: float = Field(
        description="largest distance in either direction, of samples and vertices: a lower "
        "bound of the largest distance there is, see `deviation.max`"
    )
    max_at: tuple[float, float, float] = Field(
        description="the point that far from the other surface, in the frame"
    )


class AspectRatio(_Record):
    """L_max · perimeter / (4√3 · area) over the faces with area; 1 is equilateral."""

    mean: float = Field(description="one sliver dominates it: read the median")
    median: float
    share_over_4: float = Field(description="share of faces above 4, or without area")


class Validity(_Record):
    """Whether a mesh is a well-formed surface, on its welded vertices.

    A count that is null was not taken: that is neither a pass nor a failure.
    """

    watertight: bool = Field(description="every edge has exactly two faces")
    boundary_edges: int = Field(description="edges with one face")
    non_manifold_edges: int = Field(description="edges with more than two faces")
    opposed_edges: int = Field(
        description="edges across which two faces turn their outsides in opposite directions"
    )
    cracks: int | None = Field(
        None,
        description="edges of open borders that run within 1e-4 of the radius of another open "
        "border; null: not tested, or a report from before this count",
    )
    degenerate_faces: int = Field(
        description="faces without area, those with two corners at one place among them"
    )
    duplicate_faces: int = Field(description="faces with the same three vertices as an earlier one")
    flipped_faces: int | None = Field(
        description="faces turned by more than a right angle against the input's; "
        "null where there is no input to compare with"
    )
    self_intersections: int | None = Field(
        description="pairs of faces that pass through each other or overlap in their plane; "
        "null: not tested, because the test would not have ended in bounded time"
    )
    components: int = Field(description="pieces connected by shared vertices")


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
    curvature_error: float | None = Field(
        description="mean |H - H'| with the closest point, of mean curvatures over a ball, "
        "times the radius; null where the reference is points"
    )
    fscore: float = Field(description="harmonic mean of precision and recall within τ = 0.01")
    emd: float = Field(description="mean distance under the best one-to-one matching of samples")
    aspect_ratio: AspectRatio
    validity: Validity


class Convention(_Record):
    """What one metric means and what it was taken from."""

    definition: str
    unit: Unit
    samples: int | None = Field(description="drawn from each surface; null: no samples")
    seed: int | None = Field(description="of the measured mesh's samples")
    reference_seed: int | None = Field(description="of the reference's samples")


class Conventions(_Record):
    """What the numbers mean."""

    sampling: str = Field(description="how points are drawn")
    radius: str = Field(description="the unit of lengths")
    floor: str = Field(description="what the floor is")
    metrics: dict[str, Convention] = Field(description="by key")


class Baselines(_Record):
    """What plain methods make of the same input."""

    closest_point: Metrics = Field(description="every vertex at its closest point of the reference")
    laplacian: Metrics = Field(description="ten half steps to the mean of the neighbours")


class WorstPoint(_Record):
    """A point of one surface that lies far from the other.

    Where the source was aligned, this is in the place it was brought to.
    """

    on: Literal["mesh", "reference"] = Field(description="the surface it is a point of")
    position: tuple[float, float, float] = Field(description="model units")
    closest: tuple[float, float, float] = Field(
        description="the closest point of the other surface, model units"
    )
    distance: float = Field(description="between the two, relative to the radius")


class Directed(_Record):
    """Distances of samples of one surface to the other surface, relative to the radius."""

    mean: float = Field(description="mean over the samples")
    rms: float = Field(description="root of the mean of the squares")
    p95: float = Field(description="95th percentile of the samples")
    max: float = Field(description="of samples and vertices: a lower bound of the largest there is")
    at: tuple[float, float, float] = Field(description="the point that far away, in model units")
    beyond_percent: float = Field(description="share of the area farther than 1 % of the radius")
    beyond_permille: float = Field(description="share of the area farther than .1 % of the radius")
    beyond_bound: float | None = Field(
        description="share of the area farther than the option `quality.bound`; null without one"
    )


class SignedDistances(_Record):
    """Distances of the mesh's samples to the reference, negative inside; relative to the radius."""

    mean: float = Field(description="mean over the samples")
    p5: float = Field(description="5th percentile: how far the mesh lies inside")
    p95: float = Field(description="95th percentile: how far it lies outside")


class Histogram(_Record):
    """Shares of the area by distance, in 64 bins of equal width that begin at 0."""

    upper: float = Field(description="end of the last bin, relative to the radius")
    missing: tuple[float, ...] = Field(description="of the reference; empty where it has no part")
    extra: tuple[float, ...] = Field(description="of the mesh; empty where it has no part")


class Directions(_Record):
    """What point_to_surface means, each way apart, of the mesh judged last: refined or input."""

    missing: Directed = Field(description="from the reference to the mesh: what the mesh lacks")
    extra: Directed = Field(description="from the mesh to the reference: what it has besides")
    signed: SignedDistances | None = Field(
        description="null where the reference is not closed, or its faces are not turned alike: "
        "it has no inside"
    )
    histogram: Histogram


Division = Literal["node", "mesh", "material", "group"]


class Part(_Record):
    """One node, mesh, material or group against all of the other surface."""

    name: str = Field(description="of a node with those above it; empty for what is in no part")
    found: Literal["both", "missing", "extra"] = Field(
        description="missing: the mesh has nothing where the reference has this part; extra: the "
        "reference has nothing where the mesh has it"
    )
    missing: Directed | None = Field(description="null where the reference has no part so named")
    extra: Directed | None = Field(description="null where the mesh has no part so named")
    signed: SignedDistances | None
    histogram: Histogram


class PerPart(_Record):
    """The directions again, of each part."""

    by: Division = Field(description="what the parts are")
    count: int = Field(description="parts there are, of either file")
    missing: int = Field(description="parts of the reference that the mesh lacks")
    extra: int = Field(description="parts of the mesh that the reference lacks")
    parts: tuple[Part, ...] = Field(description="up to 200, the worst first")


class Quality(_Record):
    """The metric set of input, refined mesh and floor, under one sampling."""

    input: Metrics
    refined: Metrics | None = Field(None, description="absent where nothing was refined")
    floor: Metrics
    baselines: Baselines | None = Field(None, description="absent unless asked for")
    worst_points: tuple[WorstPoint, ...] = Field(
        description="up to ten places where refined mesh, or input, and reference are farthest "
        "apart, the worst first"
    )
    directions: Directions | None = Field(
        None, description="absent from reports before meshcone.report/2"
    )
    per: PerPart | None = Field(None, description="absent unless the option `quality.per` is set")
    conventions: Conventions
