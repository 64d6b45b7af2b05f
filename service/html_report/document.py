"""Putting reports, previews and the dashboard's own scripts into one file."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from meshcone.gates.results import AssetResult, GateRun
from meshcone.gates.words import names_in_words
from service.dashboard.static_files import own_names, required

_FRAME = Path(__file__).parent / "frame.html"
_STYLES = ("dashboard.css", "job.css", "jobs.css")
_START = 'import "meshcone/report-page";'
# Those that did not pass come first; a file with all meshes of a large run would be too big.
MOST_PREVIEWS = 12


@dataclass(frozen=True)
class ReportedAsset:
    """One asset of a report.

    Attributes:
        name: what people know it by.
        ending: its verdict or outcome in a word, or ``error``.
        report: as JSON; None where there is none.
        preview: a GLB file of :func:`meshcone.views.preview.preview_glb`; None where there is none.
        pictures: a PNG file of :func:`meshcone.views.pictures.pictures_png`; None where there is
            none.
        error: why there is no report.
        refined: name of the refined file, where there is one.
        report_name: name of the report's own file, where there is one.
    """

    name: str
    ending: str
    report: str | None = None
    preview: bytes | None = None
    pictures: bytes | None = None
    error: str | None = None
    refined: str | None = None
    report_name: str | None = None


def html_report(title: str, assets: Sequence[ReportedAsset]) -> bytes:
    """One HTML file that shows all assets, with everything it needs inside.

    Args:
        title: of the page.
        assets: at least one.
    """
    shown = _with_preview(assets)
    imports = json.dumps({"imports": _modules()})
    style, theme = "".join(map(_style, _STYLES)), _script("theme.js")
    library = _script("three.js") if shown else ""
    html = Template(_FRAME.read_text()).substitute(
        title=escape(title),
        policy=_policy(style, [theme, library, imports, _START]),
        style=style,
        theme=theme,
        library=library,
        imports=imports,
        words=_embedded(names_in_words()),
        assets=_embedded([_described(asset, looked_at=asset in shown) for asset in assets]),
        previews="\n".join(
            f'<script type="text/plain" id="preview-{number}">{_packed(asset.preview)}</script>'
            for number, asset in enumerate(assets)
            if asset in shown and asset.preview is not None
        ),
        start=_START,
    )
    return html.encode()


def html_of_run(run: GateRun) -> bytes:
    """All assets of a run as one HTML file; what a page shows of each was asked for."""
    only = run.assets[0].name if len(run.assets) == 1 else f"{len(run.assets)} assets"
    title = f"{only}: {run.verdict.replace('_', ' ')}"
    if run.label is not None:
        title = f"{run.label}: {title}"
    return html_report(title, list(map(_reported, run.assets)))


def _reported(asset: AssetResult) -> ReportedAsset:
    reason = None
    if asset.view is None:
        reason = "No gate applies to this asset." if asset.error is None else asset.error.message
    return ReportedAsset(
        name=asset.name,
        ending=asset.ending,
        report=None if asset.view is None else asset.view.report,
        preview=None if asset.view is None else asset.view.preview,
        pictures=None if asset.view is None else asset.view.pictures,
        error=reason,
    )


def _with_preview(assets: Sequence[ReportedAsset]) -> list[ReportedAsset]:
    seen = [asset for asset in assets if asset.preview is not None]
    return sorted(seen, key=lambda asset: asset.ending == "pass")[:MOST_PREVIEWS]


def _described(asset: ReportedAsset, *, looked_at: bool) -> dict[str, Any]:
    return {
        "name": asset.name,
        "ending": asset.ending,
        "report": None if asset.report is None else json.loads(asset.report),
        "pictures": _address(asset.pictures) if looked_at else None,
        # An asset that was audited by itself has no meshes that could be missing.
        "leftOut": asset.preview is not None and not looked_at,
        "error": asset.error,
        "refined": asset.refined,
        "reportName": asset.report_name,
    }


def _modules() -> dict[str, str]:
    """Each module as a data URL, under the name the others import it by."""
    return {
        f"meshcone/{Path(name).stem}": "data:text/javascript;base64,"
        + base64.b64encode(required(name).data).decode()
        for name in own_names()
        if (name.endswith(".js") and not name.endswith("-page.js")) or name == "report-page.js"
    }


def _style(name: str) -> str:
    return required(name).data.decode()


def _script(name: str) -> str:
    # Within a page, a script ends where these letters stand, be it within a string.
    return required(name).data.decode().replace("</script", "<\\/script")


def _embedded(document: object) -> str:
    """JSON that no name in it can end early."""
    return json.dumps(document, separators=(",", ":")).replace("<", "\\u003c")


def _address(image: bytes | None) -> str | None:
    return None if image is None else f"data:image/png;base64,{base64.b64encode(image).decode()}"


def _packed(data: bytes) -> str:
    return base64.b64encode(gzip.compress(data, mtime=0)).decode()


def _policy(style: str, scripts: Sequence[str]) -> str:
    """Nothing from anywhere: what is in the file, by its hash, and modules as data."""
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src data: {' '.join(map(_hash, scripts))}",
            f"style-src {_hash(style)}",
            "img-src data:",
        ]
    )


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
