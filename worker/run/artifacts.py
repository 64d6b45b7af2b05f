"""The files a job leaves: what they hold and what they are called."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

from meshcone.gates.records import Status
from meshcone.gates.results import JUDGED
from meshcone.report.report import AnyReport, diagnostics_csv
from meshcone.views.heatmap import heatmap_glb
from meshcone.views.pictures import pictures_png
from meshcone.views.preview import preview_glb
from meshcone.views.thumbnail import thumbnail_webp
from worker.jobs.summaries import JobSummary
from worker.jobs.tallies import Tallies, tallies_of

if TYPE_CHECKING:
    from meshcone.appearance.paint import Paint
    from meshcone.surface import Mesh
    from meshcone.verbs.audit import Examination
    from meshcone.verbs.measure import Measurement
    from meshcone.verbs.refine import Refinement
    from meshcone.views.scene import Scene


logger = logging.getLogger(__name__)

_LONGEST_JUDGEMENT = 32 * 1024  # characters; a batch has thousands of them in the broker's memory


@dataclass(frozen=True)
class ArtifactFile:
    """A file to store."""

    data: bytes
    media_type: str
    filename: str


@dataclass(frozen=True)
class JobFiles:
    """What a job leaves: files by name, what the gates say, if there were any, and figures.

    Attributes:
        judgement: the parts of the report that a verdict over many jobs is made of, as JSON; None
            where they are too long to be kept beside it.
    """

    files: Mapping[str, ArtifactFile]
    verdict: Status | None
    summary: JobSummary
    tallies: Tallies
    judgement: str | None


def of_refinement(source: str, refinement: Refinement) -> JobFiles:
    """What a refinement of a source of this name leaves.

    That is mesh, report, table, certificate, a preview, a heatmap, a thumbnail and, of
    coloured files, pictures.
    """
    stem = PurePath(source).stem
    table = diagnostics_csv(refinement.report.solver).encode()
    files = {
        "mesh": ArtifactFile(refinement.data, refinement.media_type, refinement.name),
        "report": _report(stem, refinement.report.model_dump_json()),
        "diagnostics_csv": ArtifactFile(
            table, "text/csv; charset=utf-8", f"{stem}.diagnostics.csv"
        ),
        **_views(stem, refinement.scene),
    }
    if refinement.certificate is not None:
        # An .npz has no media type of its own; what it is is a ZIP archive. Its name is
        # where `meshcone verify` looks for it beside the report.
        files["certificate"] = ArtifactFile(
            refinement.certificate, "application/zip", f"{stem}.report.certificate.npz"
        )
    return _job_files(files, refinement.report)


def of_measurement(source: str, measurement: Measurement) -> JobFiles:
    """What a measurement of a source of this name leaves: its report and what there is to see."""
    stem = PurePath(source).stem
    files = {
        "report": _report(stem, measurement.report.model_dump_json()),
        **_views(stem, measurement.scene),
    }
    return _job_files(files, measurement.report)


def of_audit(source: str, found: Examination) -> JobFiles:
    """What an audit of a source of this name leaves: its report and a thumbnail."""
    stem = PurePath(source).stem
    files = {
        "report": _report(stem, found.report.model_dump_json()),
        **_thumbnail(stem, found.mesh, found.paint),
    }
    return _job_files(files, found.report)


def _job_files(files: Mapping[str, ArtifactFile], report: AnyReport) -> JobFiles:
    verdict = None if report.gates is None else report.gates.verdict
    judgement = report.model_dump_json(include=JUDGED)
    return JobFiles(
        files,
        verdict,
        JobSummary.of(report),
        tallies_of(report),
        judgement if len(judgement) <= _LONGEST_JUDGEMENT else None,
    )


def _report(stem: str, text: str) -> ArtifactFile:
    return ArtifactFile(text.encode(), "application/json", f"{stem}.report.json")


def _views(stem: str, scene: Scene) -> dict[str, ArtifactFile]:
    files = {
        name: ArtifactFile(write(scene), "model/gltf-binary", f"{stem}.{name}.glb")
        for name, write in (("preview", preview_glb), ("heatmap", heatmap_glb))
    }
    pictures = pictures_png(scene)
    if pictures is not None:
        files["pictures"] = ArtifactFile(pictures, "image/png", f"{stem}.pictures.png")
    leading = scene.refined or scene.input
    paint = None if scene.paints is None else scene.paints[0]
    return files | _thumbnail(stem, leading.mesh, paint)


def _thumbnail(stem: str, mesh: Mesh, paint: Paint | None) -> dict[str, ArtifactFile]:
    """A small picture, if there can be one: no job fails for want of what a list looks like."""
    try:
        data = thumbnail_webp(mesh, paint)
    except Exception:  # whatever it was is in the log
        logger.exception("no thumbnail could be drawn")
        data = None
    if data is None:
        return {}
    return {"thumbnail": ArtifactFile(data, "image/webp", f"{stem}.thumbnail.webp")}
