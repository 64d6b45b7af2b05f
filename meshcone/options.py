"""What a caller can ask of the engine, with every default in one place.

The models are the single source for the command line's ``--set``, the HTTP API's
``options`` field and the ``options`` section of the report. Distances are relative
to the reference's radius (the unit sphere of the paper) unless a field says otherwise.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from meshcone.errors import InputError

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Formulation = Literal["surface", "centroid"]


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
        (3.0, 1.0, 1.0, 0.3, 0.1),
        max_length=50,
        description="weight of the Laplacian in each round; its length is the number of rounds",
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
    edge_cap: Positive = Field(
        2.0,
        ge=1.0,
        description="cap on each edge, as a multiple of the longest input edge at either end",
    )


class SolverOptions(_Section):
    """Settings of SCS."""

    tolerance: Positive = Field(1e-5, description="absolute and relative tolerance of SCS")
    max_iterations: int = Field(1000, ge=1, le=1_000_000, description="iterations per solve")
    linear_solver: Literal["auto", "qdldl", "mkl", "cpu_indirect"] = Field(
        "auto", description="linear system solver inside SCS"
    )
    time_limit: NonNegative = Field(0.0, description="seconds per solve; 0 means no limit")


class QualityOptions(_Section):
    """How the metrics are sampled."""

    samples: int = Field(5000, ge=16, le=1_000_000, description="samples per surface")
    emd_samples: int = Field(
        1024, ge=16, le=8192, description="samples per surface for the exact earth mover's distance"
    )


class Options(_Section):
    """Everything a refinement depends on besides the two files."""

    formulation: Formulation = Field("surface", description="which program to solve")
    normals: Literal["recompute", "keep"] = Field(
        "recompute", description="what happens to stored normals where positions moved"
    )
    seed: int = Field(0, ge=0, le=2**31 - 1, description="seed of every sampling")
    centroid: CentroidOptions = CentroidOptions()
    surface: SurfaceOptions = SurfaceOptions()
    solver: SolverOptions = SolverOptions()
    quality: QualityOptions = QualityOptions()


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
        close = difflib.get_close_matches(path, list(_known_paths(Options)), n=1, cutoff=0.5)
        hint = f"; did you mean '{close[0]}'?" if close else ""
        return f"unknown option '{path}'{hint}"
    return f"option '{path}': {first['msg'].lower()}"


def _known_paths(model: type[BaseModel], prefix: str = "") -> Iterable[str]:
    for name, field in model.model_fields.items():
        yield prefix + name
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from _known_paths(field.annotation, f"{prefix}{name}.")


def _json_type(value: object) -> str:
    names = {list: "an array", str: "a string", bool: "a boolean", type(None): "null"}
    return names.get(type(value), "a number")
