"""Reports (``meshcone.report/2``), one model for each mode, and what is derived from them."""

from __future__ import annotations

import csv
import io
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from meshcone.appearance.records import Appearance
from meshcone.auditing.records import AssetAudit, Changes
from meshcone.detail.records import DetailRecord
from meshcone.gates.records import GateVerdict
from meshcone.notices import WarningRecord
from meshcone.options import Options
from meshcone.program.diagnostics import Residuals, SolverReport
from meshcone.quality.deviation.records import Deviation
from meshcone.quality.records import Quality, Validity
from meshcone.report.within import WithinRecord

Outcome = Literal[
    "improved",
    "indistinguishable",
    "undecided",
    "unchanged",
    "kept",
    "misaligned",
    "reference_copy",
    "worse",
]
Agreement = Literal["indistinguishable", "different"]
Schema = Literal["meshcone.report/2"]

SCHEMA: Schema = "meshcone.report/2"


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, serialize_by_alias=True)


class InputRecord(_Record):
    """One of the two files as it was read."""

    name: str = Field(description="file name as it was given")
    format: str = Field(description="obj, glb and so on")
    member: str | None = Field(None, description="path of the mesh in the archive that was sent")
    tolerance: float | None = Field(
        None,
        description="how far the triangles may lie from the surfaces of a STEP, in model units; "
        "every distance is uncertain by as much, and the proven intervals are wider by it",
    )
    sha256: str = Field(description="hash of the file")
    resources: dict[str, str] = Field(
        default_factory=dict, description="SHA-256 of each file that was sent with it, by name"
    )
    bytes: int = Field(description="size of the file")
    vertices: int = Field(
        description="as the file stores them, split at seams; instances counted each time"
    )
    welded_vertices: int = Field(description="distinct positions some face uses")
    faces: int = Field(
        description="triangles, as the file lists them; those without area among them, instances "
        "counted each time"
    )
    polygons: int = Field(description="faces as the file stores them; instances counted each time")
    meshes: int = Field(
        description="meshes that are drawn, at every node that places them; in an OBJ objects"
    )
    materials: int = Field(description="materials that its faces name")
    validity: Validity


class Inputs(_Record):
    """Both files."""

    source: InputRecord
    reference: InputRecord


class Audits(_Record):
    """What each of the meshes is by itself: the whole asset, not only its surface."""

    source: AssetAudit
    reference: AssetAudit | None = Field(None, description="absent where there was none")
    refined: AssetAudit | None = Field(None, description="absent where nothing was refined")


class FrameRecord(_Record):
    """The similarity x ↦ (x − centre) / radius that all relative distances are in."""

    centre: tuple[float, float, float] = Field(description="model units")
    radius: float = Field(description="model units")


Matrix = Annotated[
    list[Annotated[list[FiniteFloat], Field(min_length=4, max_length=4)]],
    Field(min_length=4, max_length=4),
]


class AlignmentRecord(_Record):
    """How the source was brought to the reference before anything else.

    Distances are root mean squares over samples of either surface to the other, in model
    units. The refined file stays where the source was.
    """

    matrix: Matrix = Field(description="(4, 4) from source to reference, for column vectors")
    method: Literal["none", "correspondence", "icp"] = Field(
        description="how the motion was found: in closed form where the faces are the same, else "
        "by a search"
    )
    before: float = Field(description="distance before the motion")
    after: float = Field(description="distance after it")
    note: str | None = Field(description="why nothing was moved, if nothing was")


class Displacement(_Record):
    """How far the written vertices lie from the input's, relative to the radius."""

    mean: float = Field(description="mean over the vertices")
    max: float = Field(description="largest of a vertex")


class OutputRecord(_Record):
    """The refined file."""

    name: str = Field(description="file name")
    sha256: str = Field(description="hash of the file")
    bytes: int = Field(description="size of the file")


class CertificateRecord(_Record):
    """The last round's optimality, recomputed from its program without a solver."""

    tolerance: float = Field(description="what each residual must not exceed")
    holds: bool = Field(description="whether none of the residuals at the optimum exceeds it")
    round: int = Field(description="the round it is about, counted from 1")
    cones: dict[str, int] = Field(description="cones of each kind, all of them checked")
    active: dict[str, int] = Field(description="cones with a multiplier, by kind")
    relaxation_is_optimal: bool = Field(
        description="no cone is active: the optimum without cones satisfies all of them"
    )
    optimum: Residuals = Field(description="at the solver's precision")
    written: Residuals = Field(description="at the positions as the refined file stores them")
    precision: float = Field(
        description="largest distance between optimum and written positions, relative"
    )


class Timings(_Record):
    """Wall-clock seconds of each stage."""

    read: float = Field(description="reading both files")
    align: float = Field(0.0, description="bringing the source to the reference")
    solve: float = Field(0.0, description="all rounds")
    quality: float = Field(0.0, description="metrics and proof")
    write: float = Field(0.0, description="writing the refined file")
    audit: float = Field(0.0, description="looking at the whole assets")
    total: float = Field(description="all of it")
    metrics: dict[str, float] = Field(
        default_factory=dict,
        description="what the stage 'quality' was spent on, by metric or the search behind several",
    )


Statement = Annotated[
    str | None,
    Field(
        description="what is proven of the deviation, in one sentence and in model units; absent "
        "where nothing is"
    ),
]
NotExamined = Annotated[
    tuple[str, ...],
    Field(
        description="codes of warnings that were not examined, or not everywhere: their absence "
        "says nothing"
    ),
]
AppearanceSection = Annotated[
    Appearance | None,
    Field(description="absent where the reference has no colours, or where it was turned off"),
]
AssetSection = Annotated[
    Audits | None, Field(description="absent where the option `audit` is false")
]
ChangesSection = Annotated[
    Changes | None,
    Field(
        description="what differs in the source from the reference besides the surface; absent "
        "where the option `audit` is false"
    ),
]
ProvenSection = Annotated[
    Deviation | None, Field(description="absent where the option `deviation.prove` is false")
]


class MeasureReport(_Record):
    """Metrics of a mesh against a reference, nothing moved."""

    schema_: Schema = Field(SCHEMA, alias="schema", description="name of this form of report")
    mode: Literal["measure"] = Field("measure", description="what was done")
    version: str = Field(description="version of MeshCone that wrote it")
    statement: Statement = None
    outcome: Agreement = Field(description="whether samples can tell the two surfaces apart")
    inputs: Inputs
    frame: FrameRecord
    alignment: AlignmentRecord | None = Field(description="absent where none was asked for")
    options: Options
    quality: Quality
    appearance: AppearanceSection = None
    asset: AssetSection = None
    changes: ChangesSection = None
    deviation: ProvenSection = None
    gates: GateVerdict | None = Field(None, description="absent where there were no gates")
    warnings: list[WarningRecord]
    not_examined: NotExamined = ()
    timings: Timings

    def __repr__(self) -> str:
        return _in_a_line(self)

    __str__ = __repr__


class Report(_Record):
    """Everything a refinement says of itself."""

    schema_: Schema = Field(SCHEMA, alias="schema", description="name of this form of report")
    mode: Literal["refine"] = Field("refine", description="what was done")
    version: str = Field(description="version of MeshCone that wrote it")
    statement: Statement = None
    outcome: Outcome = Field(description="what the refinement came to, by a rule")
    inputs: Inputs
    frame: FrameRecord
    alignment: AlignmentRecord | None = Field(description="absent where none was asked for")
    options: Options
    quality: Quality
    appearance: AppearanceSection = None
    asset: AssetSection = None
    changes: ChangesSection = None
    deviation: ProvenSection = None
    within: WithinRecord | None = Field(None, description="absent where no tolerance was asked for")
    output: OutputRecord
    displacement: Displacement
    detail: DetailRecord | None = Field(None, description="absent where no faces could be added")
    solver: SolverReport
    certificate: CertificateRecord | None = Field(
        description="absent where the input was kept as it was"
    )
    gates: GateVerdict | None = Field(None, description="absent where there were no gates")
    warnings: list[WarningRecord]
    not_examined: NotExamined = ()
    timings: Timings

    def __repr__(self) -> str:
        return _in_a_line(self)

    __str__ = __repr__


class AuditInputs(_Record):
    """The file that was audited, and its reference."""

    source: InputRecord
    reference: InputRecord | None = Field(None, description="absent where there was none")


class AuditReport(_Record):
    """What an asset is by itself, and what changed against its reference, if it has one."""

    schema_: Schema = Field(SCHEMA, alias="schema", description="name of this form of report")
    mode: Literal["audit"] = Field("audit", description="what was done")
    version: str = Field(description="version of MeshCone that wrote it")
    inputs: AuditInputs
    options: Options
    asset: Audits
    changes: Changes | None = Field(None, description="absent where there was no reference")
    gates: GateVerdict | None = Field(None, description="absent where there were no gates")
    warnings: list[WarningRecord]
    not_examined: NotExamined = ()
    timings: Timings

    def __repr__(self) -> str:
        sections = ", ".join(name.rstrip("_") for name in type(self).model_fields)
        return f"<{type(self).__name__} {self.inputs.source.name}; has {sections}>"

    __str__ = __repr__


AnyReport = Report | MeasureReport | AuditReport


def _in_a_line(report: MeasureReport | Report) -> str:
    # The whole of it fills screens, in a notebook and in a failed test.
    names = report.inputs.source.name, report.inputs.reference.name
    sections = ", ".join(name.rstrip("_") for name in type(report).model_fields)
    return f"<{type(report).__name__} {' → '.join(names)}: {report.outcome}; has {sections}>"


def diagnostics_csv(solver: SolverReport) -> str:
    """Write SCS's iterations in the rounds it was asked in as one table, a row an iteration."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    asked = [record for record in solver.rounds if record.history]
    columns = list(asked[0].history) if asked else []
    writer.writerow(["round", *columns])
    for record in asked:
        for row in zip(*(record.history[name] for name in columns), strict=True):
            writer.writerow([record.round, *row])
    return text.getvalue()
