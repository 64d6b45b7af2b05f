"""The files a job leaves: what they hold and what they are called."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

from meshcone.report import MeasureReport, diagnostics_csv

if TYPE_CHECKING:
    from meshcone.refine import Refinement


@dataclass(frozen=True)
class ArtifactFile:
    """A file to store."""

    data: bytes
    media_type: str
    filename: str


def of_refinement(source: str, refinement: Refinement) -> dict[str, ArtifactFile]:
    """What a refinement of a source of this name leaves: mesh, report, table, certificate."""
    stem = PurePath(source).stem
    table = diagnostics_csv(refinement.report.solver).encode()
    files = {
        "mesh": ArtifactFile(refinement.data, refinement.media_type, refinement.name),
        "report": _report(stem, refinement.report.model_dump_json()),
        "diagnostics_csv": ArtifactFile(
            table, "text/csv; charset=utf-8", f"{stem}.diagnostics.csv"
        ),
    }
    if refinement.certificate is not None:
        # An .npz has no media type of its own; what it is is a ZIP archive. Its name is
        # where `meshcone verify` looks for it beside the report.
        files["certificate"] = ArtifactFile(
            refinement.certificate, "application/zip", f"{stem}.report.certificate.npz"
        )
    return files


def of_measurement(source: str, report: MeasureReport) -> dict[str, ArtifactFile]:
    """What a measurement of a source of this name leaves: its report alone."""
    return {"report": _report(PurePath(source).stem, report.model_dump_json())}


def _report(stem: str, text: str) -> ArtifactFile:
    return ArtifactFile(text.encode(), "application/json", f"{stem}.report.json")
