"""What a caller can ask of the engine, with every default in one place.

The models are the single source for the command line's ``--set``, the HTTP API's
``options`` field and the ``options`` section of the report. Distances are relative
to the reference's radius (the unit sphere of the paper) unless a field says otherwise.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from meshcone.errors import InputError
from meshcone.gates.rules import GateRule
from meshcone.suggestions import did_you_mean

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Formulation = Literal["surface", "centroid"]
Mode = Literal["refine", "measure"]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class CentroidOptions(_Section):
    """The paper's program (section "Mathematical Formulation")."""

    regularization: Positive = Field(0.01, description="Tikhonov weight λ")
    edge_cap: Positive = Field(0.5, description="cap δ on every edge's length")
    samples: int = Field(
        10_000, ge=1, le=1_000_000, description="reference samples for the centroid μ"
    )
    form: Literal["reduced", "cvxpy"] = Field(
        "reduced",
        description="reduced: positions only, handed straight to SCS; "
        "cvxpy: the model as the paper wrote it",
    )


class SurfaceOptions(_Section):
    """The surface program: distances to the reference's surface, both ways."""

    fairness: tuple[NonNegative, ...] = Field(
        (3.0, 1.0, 0.3, 0.05, 0.01),
        max_length=50,
        description="weight of the Laplacian in each round; its length is the number of rounds, "
        "and without any the source is returned as it was",
    )
    tangential: Positive = Field(
        0.1, description="weight of tangential against normal distance to the reference"
    )
    proximity: Positive = Field(0.01, description="weight on the distance to the previous round")
    reverse: NonNegative = Field(
        3.0, description="weight of reference samples pulled from the moving source"
    )
    noise_scale: Positive = Field(
        0.5, description="noise over edge length at which the fairness acts in full"
    )
    reverse_from: int = Field(
        1, ge=0, description="first round, counted from 0, in which reference samples pull"
    )
    reach: Positive = Field(
        4.0,
        description="how far from the source a reference sample may lie and still pull, in "
        "medians of the source's own distance",
    )
    fairness_knee: Positive = Field(
        3.0,
        description="fairness above this acts in full only where the noise exceeds the "
        "edges by as much",
    )
    edge_cap: Positive = Field(
        4.0,
        ge=1.0,
        description="cap on each edge, as a multiple of the longest input edge at either end "
        "or of the mean one, whichever is longer",
    )


class Length(_Section):
    """A length, relative to the reference's radius or in model units: exactly one of the two."""

    relative: Positive | None = Field(None, description="share of the reference's radius")
    model: Positive | None = Field(None, description="in the unit of the files")

    @model_validator(mode="after")
    def _exactly_one(self) -> Length:
        if (self.relative is None) == (self.model is None):
            raise ValueError("give either 'relative' or 'model'")
        return self

    def in_frame(self, radius: float) -> float:
        """Return the length in a frame whose unit is ``radius`` model units."""
        if self.model is not None:
            return self.model / radius
        assert self.relative is not None  # noqa: S101 - the validator above has seen to it
        return self.relative


class EdgeCapOptions(_Section):
    """A further cap on edge lengths; exactly one of the fields."""

    length: Length | None = Field(None, description="the same cap for every edge")
    times_input: Positive | None = Field(None, description="multiple of each edge's input length")
    times_local_median: Positive | None = Field(
        None, description="multiple of the median input length of the edges at either end"
    )

    @model_validator(mode="after")
    def _exactly_one(self) -> EdgeCapOptions:
        given = [self.length, self.times_input, self.times_local_median]
        if sum(value is not None for value in given) != 1:
            raise ValueError("give one of 'length', 'times_input' and 'times_local_median'")
        return self


class PinOptions(_Section):
    """Which vertices stay where they are."""

    boundary: bool = Field(False, description="vertices on open borders")
    region_borders: bool = Field(
        False, description="vertices where two materials or groups meet, or one ends"
    )
    vertices: tuple[Annotated[int, Field(ge=0)], ...] = Field(
        (), description="vertices by their index in the file, counted from 0"
    )


class ConeOptions(_Section):
    """Constraints every answer of the surface program must satisfy."""

    edge_cap: EdgeCapOptions | None = Field(
        None, description="a further cap on edge lengths; the tighter one holds for each edge"
    )
    max_displacement: Length | None = Field(None, description="how far any vertex may move")
    tolerance_band: Length | None = Field(
        None, description="distance of every vertex from the plane at its closest reference point"
    )
    pin: PinOptions = PinOptions()


class SolverOptions(_Section):
    """How a round's program is solved, and the settings of SCS."""

    method: Literal["active", "full"] = Field(
        "active",
        description="active: the relaxation, then only the cones it violates; "
        "full: every cone to SCS at once",
    )
    certify: bool = Field(True, description="have SCS confirm the last round's optimum")
    certify_limit: int = Field(
        100_000, ge=0, description="vertices above which SCS is not asked to confirm"
    )
    tolerance: Positive = Field(
        1e-5, description="what no residual of the certificate may exceed; also SCS's tolerance"
    )
    max_iterations: int = Field(1000, ge=1, le=1_000_000, description="iterations per solve")
    linear_solver: Literal["auto", "qdldl", "mkl", "cpu_indirect"] = Field(
        "auto", description="linear system solver inside SCS"
    )
    time_limit: NonNegative = Field(0.0, description="seconds per solve; 0 means no limit")


PartKey = Annotated[int, Field(ge=0)] | Annotated[str, Field(min_length=1, max_length=200)]


class SelectOptions(_Section):
    """What to refine: the faces that every list given here names; the rest stays as it is."""

    nodes: tuple[PartKey, ...] = Field(
        (), max_length=1000, description="nodes of a glTF, with all below them"
    )
    meshes: tuple[PartKey, ...] = Field(
        (), max_length=1000, description="meshes of a glTF, objects (`o`) of an OBJ"
    )
    groups: tuple[PartKey, ...] = Field((), max_length=1000, description="groups (`g`) of an OBJ")
    materials: tuple[PartKey, ...] = Field((), max_length=1000, description="materials")

    def given(self) -> dict[str, tuple[str | int, ...]]:
        """The lists that are not empty, by their names."""
        lists = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: keys for name, keys in lists.items() if keys}


class QualityOptions(_Section):
    """How the metrics are sampled."""

    sampling: Literal["sobol", "random"] = Field(
        "sobol",
        description="sobol: a scrambled low-discrepancy sequence; random: independent draws",
    )
    samples: int = Field(5000, ge=16, le=1_000_000, description="samples per surface")
    emd_samples: int = Field(
        1024, ge=16, le=8192, description="samples per surface for the exact earth mover's distance"
    )
    curvature_samples: int = Field(
        512,
        ge=16,
        le=1_000_000,
        description="samples per surface for the curvature error, of the others",
    )
    intersection_pairs: int = Field(
        5_000_000,
        ge=0,
        le=1_000_000_000,
        description="pairs of faces that may be tested for self-intersections, about a "
        "microsecond each; a mesh that has more is not tested",
    )


# What a preset puts in place of the defaults; what a caller sets besides still holds.
_PRESETS: dict[str, dict[str, Any]] = {
    "paper": {
        "formulation": "centroid",
        "quality": {"sampling": "random", "samples": 5000, "emd_samples": 5000},
    }
}


class Options(_Section):
    """Everything a refinement depends on besides the two files."""

    mode: Mode = Field(
        "refine",
        description="refine: move the source's vertices; measure: report how it compares with "
        "the reference and move nothing",
    )
    gates: dict[str, GateRule] = Field(
        {}, description="bounds on values of the report, by their names; see gates"
    )
    preset: Literal["default", "paper"] = Field(
        "default",
        description="which defaults hold: paper takes the formulation, the sampling and the "
        "numbers of samples of the paper's experiments",
    )
    formulation: Formulation = Field("surface", description="which program to solve")
    effort: Literal["fast", "best"] = Field(
        "best",
        description="fast: the surface program once, as set; best: several settings of it, "
        "of which the one closest to the reference is kept",
    )
    align: Literal["none", "rigid", "similarity"] = Field(
        "none",
        description="how the source is brought to the reference first; the refined file "
        "stays where the source was",
    )
    normals: Literal["recompute", "keep"] = Field(
        "recompute", description="what happens to stored normals where positions moved"
    )
    instances: Literal["refuse", "split"] = Field(
        "refuse",
        description="what happens to a mesh that several nodes of a glTF use, and to vertex "
        "data that several meshes share: refuse, or split into copies",
    )
    draco: Literal["plain", "encode"] = Field(
        "plain",
        description="how what was compressed with Draco is written: as plain buffers, or "
        "compressed again",
    )
    select: SelectOptions = SelectOptions()
    seed: int = Field(0, ge=0, le=2**31 - 1, description="seed of every sampling")
    baselines: bool = Field(
        False,
        description="score plain closest-point projection and Laplacian smoothing of the "
        "source as well",
    )
    centroid: CentroidOptions = CentroidOptions()
    surface: SurfaceOptions = SurfaceOptions()
    cones: ConeOptions = ConeOptions()
    solver: SolverOptions = SolverOptions()
    quality: QualityOptions = QualityOptions()

    @model_validator(mode="before")
    @classmethod
    def _take_preset(cls, given: Any) -> Any:
        if not isinstance(given, dict) or not isinstance(given.get("preset"), str):
            return given
        return _filled_in(given, _PRESETS.get(given["preset"], {}))


def _filled_in(given: dict[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Add what a nested document leaves open."""
    filled = dict(given)
    for name, value in defaults.items():
        if isinstance(value, Mapping) and isinstance(filled.setdefault(name, {}), dict):
            filled[name] = _filled_in(filled[name], value)
        else:
            filled.setdefault(name, value)
    return filled


def parse_options(document: Mapping[str, Any]) -> Options:
    """Validate a nested mapping of options.

    Raises:
        InputError: naming the first option that is unknown or out of range.
    """
    try:
        return Options.model_validate(document)
    except ValidationError as error:
        raise InputError(_explain(error)) from None


def parse_options_json(text: str | bytes) -> Options:
    """Validate a JSON object of options.

    Raises:
        InputError: the text is no JSON object, or an option in it is unknown or out of range.
    """
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        raise InputError("options are not valid JSON") from None
    if not isinstance(document, dict):
        raise InputError(f"options must be a JSON object, found {_json_type(document)}")
    return parse_options(document)


def parse_assignments(assignments: Iterable[str]) -> dict[str, Any]:
    """Turn ``surface.edge_cap=2.5`` assignments into the nested mapping they mean.

    Values are read as JSON where they are JSON and as plain strings otherwise.

    Raises:
        InputError: an assignment has no ``=`` or sets a value and something below it.
    """
    document: dict[str, Any] = {}
    for assignment in assignments:
        path, equals, text = assignment.partition("=")
        if not equals or not path:
            raise InputError(f"expected KEY=VALUE, found '{assignment}'")
        *parents, leaf = path.split(".")
        section = document
        for parent in parents:
            section = section.setdefault(parent, {})
            if not isinstance(section, dict):
                raise InputError(f"'{parent}' in '{path}' already has a value of its own")
        try:
            section[leaf] = json.loads(text)
        except ValueError:
            section[leaf] = text
    return document


def _explain(error: ValidationError) -> str:
    first = error.errors()[0]
    path = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        return f"unknown option '{path}'{did_you_mean(path, _known_beside(path, first['loc']))}"
    return f"option '{path}': {first['msg'].lower()}"


def _known_beside(path: str, parts: tuple[int | str, ...]) -> Iterable[str]:
    if parts[0] == "gates":  # whose names are the report's, not ours
        parent = path.rpartition(".")[0]
        return (f"{parent}.{name}" for name in GateRule.model_fields)
    return _known_paths(Options)


def _known_paths(model: type[BaseModel], prefix: str = "") -> Iterable[str]:
    for name, field in model.model_fields.items():
        yield prefix + name
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from _known_paths(field.annotation, f"{prefix}{name}.")


def _json_type(value: object) -> str:
    names = {list: "an array", str: "a string", bool: "a boolean", type(None): "null"}
    return names.get(type(value), "a number")
