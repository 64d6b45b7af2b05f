"""Warnings: every code there is, and the record of one.

A warning names something that the work survives and a person should know. Its code is stable,
so that a gate can bound it and a filter can find it; the words are for people and may change.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

Side = Literal["source", "reference", "pair", "refined"]

# What reports before ``meshcone.report/2`` say is words alone.
UNCODED = "uncoded"


class Code(StrEnum):
    """The code of every warning.

    Attributes:
        meaning: what a warning with this code says, in general.
    """

    meaning: str

    SURFACE_EMPTY = "surface.empty", "the mesh holds no surface"
    SURFACE_POINTS = "surface.points", "a reference of points without faces"
    SURFACE_TESSELLATED = (
        "surface.tessellated",
        "curved surfaces that were divided into triangles, within a tolerance",
    )
    SURFACE_INSIDE_OUT = "surface.inside_out", "a closed mesh whose faces are turned inwards"
    UNITS_FACTOR_10 = "units.factor_10", "one of the two is 10 times the size of the other"
    UNITS_FACTOR_100 = "units.factor_100", "one of the two is 100 times the size of the other"
    UNITS_FACTOR_1000 = "units.factor_1000", "one of the two is 1000 times the size of the other"
    UNITS_FACTOR_25_4 = (
        "units.factor_25_4",
        "one of the two is 25.4 times the size of the other, as inches are in millimetres",
    )
    UNITS_OTHER = (
        "units.other",
        "source and reference differ in size by another factor, of 5 or more",
    )
    POSE_SCALED = "pose.scaled", "the source is the reference's shape in another size"
    POSE_MIRRORED = "pose.mirrored", "the source is the reference's shape mirrored"
    POSE_TURNED = "pose.turned", "the source is the reference's shape turned"
    POSE_MOVED = "pose.moved", "the source is the reference's shape in another place"
    POSE_APART = "pose.apart", "the bounding boxes of source and reference hardly overlap"
    POSE_MISFIT = (
        "pose.misfit",
        "source and reference do not fit; the source is returned as it was",
    )
    COVERAGE_EXTRA = (
        "coverage.extra",
        "a part of the source is far from the reference, which has nothing there",
    )
    COVERAGE_MISSING = (
        "coverage.missing",
        "a part of the reference is far from the source, which has nothing there",
    )
    NORMALS_AGAINST_WINDING = (
        "normals.against_winding",
        "most of the normals that the file stores point to the backs of their faces",
    )
    NORMALS_OPPOSED = "normals.opposed", "the normals of source and reference oppose each other"
    COLORS_NOT_COMPARED = (
        "colors.not_compared",
        "colours could not be compared, for lack of an image or a material library",
    )
    PIECES_MISSING = "pieces.missing", "a part of the reference that the source lacks"
    PIECES_EXTRA = "pieces.extra", "a part of the source that the reference lacks"
    PIECES_DISPLACED = (
        "pieces.displaced",
        "a part in another place, or of another shape, than the reference's part of that name",
    )
    MATERIALS_UNDEFINED = (
        "materials.undefined",
        "materials that faces name, but that no library that was sent defines",
    )
    MATERIALS_LIBRARY_MISSING = (
        "materials.library_missing",
        "material libraries that the file names and that were not sent",
    )
    TEXTURES_MISSING = "textures.missing", "images that the file names and that were not sent"
    CONTENT_MALFORMED = (
        "content.malformed",
        "parts of the file that say nothing of its surface and are read as if they were absent",
    )
    PIECES_COUNT = "pieces.count", "source and reference are in different numbers of pieces"

    EDGES_NON_MANIFOLD = "edges.non_manifold", "edges where more than two faces meet"
    EDGES_OPPOSED = "edges.opposed", "edges whose two faces are turned in opposite directions"
    FACES_DUPLICATE = "faces.duplicate", "faces with the same corners as another"
    FACES_CROSSING = "faces.crossing", "pairs of faces that pass through each other"
    FACES_DEGENERATE = "faces.degenerate", "faces without area"
    FACES_TOO_FEW_CORNERS = (
        "faces.too_few_corners",
        "faces with fewer than three corners, which are ignored",
    )
    FACES_CONCAVE = (
        "faces.concave",
        "large concave polygons, which are split as if they were convex",
    )
    VERTICES_ISOLATED = "vertices.isolated", "vertices that no face uses"
    TEXCOORDS_UNKNOWN = (
        "texcoords.unknown",
        "faces name texture coordinates that the file does not have; the names are ignored",
    )
    NORMALS_UNKNOWN = (
        "normals.unknown",
        "faces name normals that the file does not have; the names are ignored",
    )
    VERTICES_ASTRAY = (
        "vertices.astray",
        "vertices without finite coordinates; triangles that use one are not drawn and not read",
    )
    NODES_INVISIBLE = "nodes.invisible", "meshes at nodes that are switched off, which are not read"
    NODES_FLATTENED = (
        "nodes.flattened",
        "meshes at nodes that scale them to a line or a point, which are not read",
    )
    NODES_LEVEL = (
        "nodes.level",
        "levels of detail other than the one that is read",
    )
    SCENES_OTHER = "scenes.other", "scenes other than the default one, which are not read"
    MESHES_EMPTY = "meshes.empty", "meshes without primitives, which draw nothing"
    PRIMITIVES_EMPTY = (
        "primitives.empty",
        "primitives without vertices or with too few indices, which draw nothing",
    )
    INDICES_LEFT_OVER = "indices.left_over", "indices at the end that make no whole triangle"
    ACCESSORS_COUNT = (
        "accessors.count",
        "accessors whose count differs from that of the Draco data; the data decide",
    )
    EXTENSIONS_UNKNOWN = (
        "extensions.unknown",
        "the file requires an unknown extension; it is read as if that moved no vertex",
    )
    SCENE_RELATIVE = "scene.relative", "the scene is read where CESIUM_RTC puts it"
    SKIN_BIND_POSE = "skin.bind_pose", "skinned meshes, which are read in their bind pose"
    SKIN_INSTANCES = (
        "skin.instances",
        "instances of skinned meshes, which are not read",
    )
    MORPH_BASE_SHAPE = (
        "morph.base_shape",
        "meshes with morph targets, which are read in their base shape",
    )

    WRITING_DRACO = "writing.draco", "writing changes what is compressed with Draco"
    WRITING_MESHOPT = "writing.meshopt", "writing changes what is compressed with meshopt"
    WRITING_SPLIT = "writing.split", "writing copies data that several nodes or meshes share"
    WRITING_TOGETHER = (
        "writing.together",
        "writing moves shared data once, because all nodes that share them agree",
    )
    WRITING_STORAGE = (
        "writing.storage",
        "writing stores data in another type, in full in place of sparse, or within the document "
        "in place of a file",
    )
    WRITING_SELECTED = "writing.selected", "a selection leaves a part of the source as it is"
    WRITING_WEIGHTS = (
        "writing.weights",
        "vertices that were added follow fewer joints than those around them together",
    )
    WRITING_DIAGONALS = (
        "writing.diagonals",
        "diagonals were swapped across faces of the source: the texture's map is another inside, "
        "with the outline that it had",
    )
    SOLVER_UNFINISHED = (
        "solver.unfinished",
        "the solver stopped in a round without meeting its tolerance",
    )
    SOLVER_KEPT_INPUT = (
        "solver.kept_input",
        "every answer was worse than the input somewhere; the input is returned as it was",
    )
    SOLVER_CONES_UNMET = (
        "solver.cones_unmet",
        "the input is returned, and does not satisfy every constraint that was asked for",
    )
    GATES_NONE = "gates.none", "no gate applies to the asset"

    def __new__(cls, value: str, meaning: str) -> Self:
        """Keep the meaning beside the value."""
        code = str.__new__(cls, value)
        code._value_ = value
        code.meaning = meaning
        return code


@dataclass(frozen=True)
class Notice:
    """What a reader or writer has to say of one file.

    Attributes:
        words: what was found and what came of it, without the file's name.
        where: the place in the file, such as ``line 5``, if there is one.
    """

    code: Code
    words: str
    where: str | None = None

    def about(self, side: Side, file: str) -> WarningRecord:
        """The warning of a report, of one of its files."""
        place = f", {self.where}" if self.where else ""
        words = f"{side} {file}{place}: {self.words}"
        return WarningRecord(code=self.code, side=side, where=self.where, words=words)


class WarningRecord(BaseModel):
    """Something to know of a file or of the pair that is not an error.

    A plain text, as earlier reports have it, is read as a warning without a code.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    code: str = Field(description="what kind of warning it is; docs/warnings.md lists all")
    side: Side = Field(description="what it is about")
    where: str | None = Field(
        None, description="the line, element, mesh or part it is about; null for all of it"
    )
    words: str = Field(description="the warning in one sentence")

    def __str__(self) -> str:
        return self.words if self.code == UNCODED else f"{self.code}: {self.words}"

    @model_validator(mode="before")
    @classmethod
    def _from_words(cls, value: Any) -> Any:
        if isinstance(value, str):
            return {"code": UNCODED, "side": "pair", "words": value}
        return value


@dataclass(frozen=True)
class Told:
    """What a search for warnings found, and what it did not search for.

    Attributes:
        warnings: what was found.
        not_examined: codes that nobody looked for, or not everywhere: that they are not
            among the warnings says nothing.
    """

    warnings: list[WarningRecord]
    not_examined: frozenset[Code] = frozenset()

    def __add__(self, other: Told) -> Told:
        return Told(self.warnings + other.warnings, self.not_examined | other.not_examined)

    def has(self, code: Code) -> bool:
        """Whether a warning of this code was found."""
        return any(found.code == code for found in self.warnings)

    def section(self) -> dict[str, Any]:
        """Both as fields of a report."""
        return {
            "warnings": self.warnings,
            "not_examined": tuple(str(code.value) for code in sorted(self.not_examined)),
        }


def meaning_of(code: str) -> str:
    """What a code says in general; the code itself if this version does not know it."""
    return _MEANINGS.get(code, code)


def warning(code: Code, side: Side, words: str, where: str | None = None) -> WarningRecord:
    """A warning of a known code."""
    return WarningRecord(code=code, side=side, words=words, where=where)


_MEANINGS = {code.value: code.meaning for code in Code}
_SECTION = "warnings"
_FAMILIES = sorted({code.partition(".")[0] for code in Code})
# What gates call a number of warnings: all, those of a family such as normals, those of a code.
WARNINGS = frozenset([_SECTION, *(f"{_SECTION}.{name}" for name in (*_FAMILIES, *Code))])


# What only a pair of meshes can show, and what is told where its colours are not compared.
FITS = frozenset(
    {
        Code.COVERAGE_EXTRA,
        Code.COVERAGE_MISSING,
        Code.NORMALS_OPPOSED,
        Code.PIECES_DISPLACED,
        Code.PIECES_EXTRA,
        Code.PIECES_MISSING,
    }
)
COLORS = frozenset({Code.COLORS_NOT_COMPARED})
OF_PAIRS = (
    FITS
    | COLORS
    | {Code.PIECES_COUNT}
    | {code for code in Code if code.startswith(("units.", "pose."))} - {Code.POSE_MISFIT}
)


def is_named(code: str, key: str) -> bool:
    """Whether a gate's name is about a code, alone or with others."""
    return f"{_SECTION}.{code}.".startswith(f"{key}.")


def warnings_named(warnings: Iterable[WarningRecord], key: str) -> list[WarningRecord]:
    """The warnings that a gate's name is about; none where it is about something else."""
    if key not in WARNINGS:
        return []
    return [each for each in warnings if is_named(each.code, key)]
