"""The page of a run of gates."""

from __future__ import annotations

from meshcone.gates.results import AssetResult, GateRun
from service.html_report.document import ReportedAsset, html_report


def html_of_run(run: GateRun) -> bytes:
    """All assets of a run as one HTML file; what a page shows of each was asked for."""
    only = run.assets[0].name if len(run.assets) == 1 else f"{len(run.assets)} assets"
    return html_report(f"{only}: {run.verdict.replace('_', ' ')}", list(map(_reported, run.assets)))


def _reported(asset: AssetResult) -> ReportedAsset:
    reason = None
    if asset.view is None:
        reason = "No gate applies to this asset." if asset.error is None else asset.error.message
    return ReportedAsset(
        name=asset.name,
        ending=asset.ending,
        report=None if asset.view is None else asset.view.report,
        preview=None if asset.view is None else asset.view.preview,
        error=reason,
    )
