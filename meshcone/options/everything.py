"""All options of a refinement, and the presets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from meshcone.errors import InputError
from meshcone.gates.keep import Kept
from meshcone.gates.rules import GateRule
from meshcone.options.cones import ConeOptions
from meshcone.options.detail import DetailOptions
from meshcone.options.deviation import DeviationOptions
from meshcone.options.files import Level, Member, ReferenceOptions, SceneKey, SelectOptions
from meshcone.options.program import CentroidOptions, SolverOptions, SurfaceOptions
from meshcone.options.quality import QualityOptions
from meshcone.options.section import Section
from meshcone.options.tolerance import TOLERANCE_LENGTH, Tolerance

Formulation = Literal["surface", "centroid"]
Mode = Literal["refine", "measure", "audit"]

WITHIN_GATE = "deviation.max"
# What a preset puts in place of the defaults; what a caller sets besides still holds.
_PRESETS: dict[str, dict[str, Any]] = {
    "paper": {
        "formulation": "centroid",
        "quality": {"sampling": "random", "samples": 5000, "emd_samples": 5000},
    }
}


def _number_as_text(given: Any) -> Any:
    is_number = isinstance(given, int | float) and not isinstance(given, bool)
    return str(given) if is_number else given


class Options(Section):
    """Everything a refinement depends on besides the two files."""

    mode: Mode = Field(
        "refine",
        description="refine: move the source's vertices; measure: report how it compares with "
        "the reference and move nothing; audit: report what the asset is, with or without a "
        "reference",
    )
    gates: dict[str, GateRule] = Field(
        {}, description="bounds on values of the report, by their names; see gates"
    )
    keep: Annotated[
        tuple[Kept, ...],
        Field(max_length=len(get_args(Kept))),
        BeforeValidator(lambda given: given.split(",") if isinstance(given, str) else given),
    ] = Field(
        (),
        description="what of its reference the source must still have, as further gates: uvs, "
        "materials, textures, animations, hierarchy, normals, or all of them; see gates",
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
    instances: Literal["auto", "split", "refuse"] = Field(
        "auto",
        description="what happens to a mesh that several nodes of a glTF use, and to vertex "
        "data that several meshes share: auto moves it once where all of them agree and else "
        "splits it, split makes copies, refuse refuses",
    )
    pose: Literal["rest", "bind"] = Field(
        "rest",
        description="where the skins and morph targets of a glTF are read and refined: at rest, as "
        "viewers show them before anything is animated, or as they are bound",
    )
    member: Member | None = Field(
        None,
        description="path of the mesh in a ZIP archive; needed where several could be meant",
    )
    scene: SceneKey | None = Field(
        None,
        description="which scene of a glTF is read, by name or index, or all; without it the one "
        "that viewers show",
    )
    lod: Level = Field(
        0, description="which level of detail of a glTF's nodes (MSFT_lod) is read, 0 the finest"
    )
    of_reference: ReferenceOptions = ReferenceOptions()
    draco: Literal["plain", "encode"] = Field(
        "plain",
        description="how what was compressed with Draco is written: as plain buffers, or "
        "compressed again",
    )
    meshopt: Literal["plain", "encode"] = Field(
        "plain",
        description="how what was compressed with meshopt is written: as plain buffers, or "
        "compressed again",
    )
    select: SelectOptions = SelectOptions()
    seed: int = Field(0, ge=0, le=2**31 - 1, description="seed of every sampling")
    baselines: bool = Field(
        False,
        description="score plain closest-point projection and Laplacian smoothing of the "
        "source as well",
    )
    within: Annotated[str, BeforeValidator(_number_as_text)] | None = Field(
        None,
        min_length=1,
        max_length=TOLERANCE_LENGTH,
        description="how close the surfaces have to be proven to be: 0.5 or 0.5mm in the unit of "
        "the files, or 0.2% of the radius; where the proof fails, the refinement is tried harder",
    )
    audit: bool = Field(
        True,
        description="look at the whole assets as well, and at what else changed: textures, "
        "materials, texture coordinates, animations; see audit",
    )
    centroid: CentroidOptions = CentroidOptions()
    surface: SurfaceOptions = SurfaceOptions()
    cones: ConeOptions = ConeOptions()
    solver: SolverOptions = SolverOptions()
    quality: QualityOptions = QualityOptions()
    deviation: DeviationOptions = DeviationOptions()
    detail: DetailOptions = DetailOptions()

    @field_validator("within")
    @classmethod
    def _a_tolerance(cls, given: str | None, info: ValidationInfo) -> str | None:
        if given is None:
            return None
        mode = info.data.get("mode", "refine")
        if mode != "refine":
            raise ValueError(f"it is for refinements, and the mode is '{mode}'")
        try:
            Tolerance.parse(given)
        except InputError as error:
            raise ValueError(error.message) from None
        return given

    def gated_within(self, source: str, reference: str) -> Options:
        """Options of one refinement to the tolerance: a gate on the proven deviation instead.

        Distances are those of the reference, which no alignment but a similarity scales the source
        to.

        Args:
            source: name of the source's file, whose format says what its unit is.
            reference: name of the reference's.

        Raises:
            InputError: nothing would be proven, there is such a gate already, or the tolerance has
                a unit that is not known for these files.
        """
        if self.within is None:
            return self
        if WITHIN_GATE in self.gates:
            raise InputError(f"a tolerance is a gate on '{WITHIN_GATE}', and there is one already")
        if not self.deviation.prove:
            raise InputError("a tolerance needs the proof that `deviation.prove` turns off")
        sized = (reference,) if self.align == "similarity" else (reference, source)
        asked = Tolerance.parse(self.within).for_files(sized)
        bound = {"max": asked.value} if asked.relative else {"max_model": asked.value}
        rule = GateRule.model_validate({**bound, "unit": asked.unit})
        return self.model_copy(update={"gates": {**self.gates, WITHIN_GATE: rule}, "within": None})

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
