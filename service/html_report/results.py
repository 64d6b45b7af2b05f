"""The page of one refinement or measurement."""

from __future__ import annotations

from typing import TYPE_CHECKING

from service.html_report.document import ReportedAsset, html_report

if TYPE_CHECKING:
    from meshcone.report.report import MeasureReport, Report
    from meshcone.views.scene import Scene


def html_of_result(
    report: Report | MeasureReport,
    scene: Scene,
    *,
    refined: str | None = None,
    report_name: str | None = None,
    most_faces: int | None = None,
) -> bytes:
    """A report and what there is to see of it, as one HTML file.

    Args:
        report: of a refinement or a measurement.
        scene: that belongs to it.
        refined: name of the refined file, if there is one.
        report_name: name of the report's own file, if there is one.
        most_faces: about how many triangles to show of each mesh; by default a preview's.
    """
    from meshcone.views.pictures import pictures_png
    from meshcone.views.preview import PREVIEW_FACES, preview_glb

    asset = ReportedAsset(
        name=f"{report.inputs.source.name} → {report.inputs.reference.name}",
        ending=report.outcome if report.gates is None else report.gates.verdict,
        report=report.model_dump_json(),
        preview=preview_glb(scene, most_faces or PREVIEW_FACES),
        pictures=pictures_png(scene),
        refined=refined,
        report_name=report_name,
    )
    return html_report(asset.name, [asset])
