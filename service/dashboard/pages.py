"""The pages as HTML: a frame, what is in it, and what the browser may load for it."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path
from string import Template

from meshcone.gates.words import names_in_words
from service.dashboard.documentation import BUILT, Documentation
from service.dashboard.static_files import own_names, required

_PAGES = Path(__file__).parent / "pages"
_IMPORT = re.compile(r'^(?:import|export)\b[^;"]*?\bfrom "(meshcone/[\w-]+)"', re.MULTILINE)


@dataclass(frozen=True)
class Page:
    """A page and the Content-Security-Policy it is sent with."""

    html: str
    policy: str


@dataclass(frozen=True)
class _Kind:
    """One of the pages: its title, the module that brings it to life, and its own style sheet."""

    title: str
    module: str
    style: str | None = None


_KINDS = {
    "jobs": _Kind("Jobs", "jobs-page", "jobs.css"),
    "job": _Kind("Job", "job-page", "job.css"),
    "compare": _Kind("Compare", "compare-page", "compare.css"),
    "docs": _Kind("API", "docs-page", "docs.css"),
}


@cache
def page(kind: str) -> Page:
    """One of the pages, by the name of its file."""
    meta = _KINDS[kind]
    imports = json.dumps({"imports": module_urls()})
    html = Template((_PAGES / "frame.html").read_text()).substitute(
        title=escape(meta.title),
        kind=kind,
        styles="\n".join(
            f'<link rel="stylesheet" href="{required(name).url}">'
            for name in filter(None, ("dashboard.css", meta.style))
        ),
        theme=required("theme.js").url,
        imports=imports,
        preloads="\n".join(
            f'<link rel="modulepreload" href="{module_urls()[name]}">'
            for name in imported(f"meshcone/{meta.module}")
        ),
        words=json.dumps(names_in_words()),
        libraries=json.dumps({name: required(name).url for name in _loaded_later(kind)}),
        module=module_urls()[f"meshcone/{meta.module}"],
        help='<a href="/help/">Help</a>' if Documentation(BUILT) else "",
        main=(_PAGES / f"{kind}.html").read_text(),
        **{f"{name}_here": _here(name == kind) for name in _KINDS},
    )
    return Page(html, _policy(imports))


def module_urls() -> dict[str, str]:
    """Where each module of ours is, by the name under which the others import it."""
    return {
        f"meshcone/{Path(name).stem}": required(name).url
        for name in own_names()
        if name.endswith(".js")
    }


def imported(module: str) -> list[str]:
    """Every module that one imports before it runs, and those that they import, the nearest first.

    A browser that is told of them fetches them all at once; by itself it learns of each from the
    one that imports it, a round trip at a time.
    """
    found = [module]
    for name in found:
        text = required(f"{name.removeprefix('meshcone/')}.js").data.decode()
        found += [each for each in dict.fromkeys(_IMPORT.findall(text)) if each not in found]
    return found[1:]


def _loaded_later(kind: str) -> tuple[str, ...]:
    return ("swagger-ui.js", "swagger-ui.css") if kind == "docs" else ("three.js",)


def _here(current: bool) -> str:
    return 'aria-current="page"' if current else ""


def _policy(imports: str) -> str:
    """Only what this server sends; of scripts in the page only the import map, by its hash.

    Swagger UI and the viewer set styles through the DOM, which needs no permission.
    """
    digest = base64.b64encode(hashlib.sha256(imports.encode()).digest()).decode()
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src 'self' 'sha256-{digest}'",
            "style-src 'self'",
            "img-src 'self' data:",
            "connect-src 'self'",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        ]
    )
