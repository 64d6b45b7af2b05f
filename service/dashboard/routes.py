"""Routes: the pages, and the files they load. None of them holds anything of a job."""

from __future__ import annotations

from typing import Annotated

from fastapi import Header, Response, status
from fastapi.responses import HTMLResponse

from service.api.routing import HeadRouter
from service.dashboard import live
from service.dashboard.documentation import BUILT, Documentation, documentation_router
from service.dashboard.pages import page
from service.dashboard.static_files import static_file
from service.problems import ProblemError, problem

router = HeadRouter(include_in_schema=False)
router.include_router(live.router)
router.include_router(documentation_router(Documentation(BUILT)))

_FOR_EVER = "public, max-age=31536000, immutable"


@router.get("/", response_class=HTMLResponse)
def jobs_page() -> Response:
    """All jobs, and a form for a new one."""
    return _page("jobs")


@router.get("/jobs/{job_id}", response_class=HTMLResponse)
def job_page(job_id: str) -> Response:  # noqa: ARG001 - the page reads it from its own address
    """One job."""
    return _page("job")


@router.get("/compare", response_class=HTMLResponse)
def compare_page() -> Response:
    """Many jobs of one label."""
    return _page("compare")


@router.get("/docs", response_class=HTMLResponse)
def docs_page() -> Response:
    """The API's description, to read and to try."""
    return _page("docs")


@router.get("/favicon.ico")
def favicon() -> Response:
    """The sign of the pages, where browsers look for one unasked."""
    return static("favicon.svg")


@router.get("/static/{name}")
def static(
    name: str,
    v: str | None = None,
    accept_encoding: Annotated[str, Header()] = "",
    if_none_match: Annotated[str | None, Header()] = None,
) -> Response:
    """A script or a style sheet; for ever, if it is asked for by its version."""
    file = static_file(name)
    if file is None:
        raise ProblemError(problem("not-found", "there is no such file"))
    headers = {
        "ETag": f'"{file.version}"',
        "Cache-Control": _FOR_EVER if v == file.version else "no-cache",
        "Vary": "Accept-Encoding",
    }
    if if_none_match is not None and file.version in if_none_match:
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    if "gzip" in accept_encoding:
        headers["Content-Encoding"] = "gzip"
        return Response(file.compressed, headers=headers, media_type=file.media_type)
    return Response(file.data, headers=headers, media_type=file.media_type)


def _page(kind: str) -> Response:
    made = page(kind)
    return HTMLResponse(
        made.html,
        headers={"Content-Security-Policy": made.policy, "Cache-Control": "no-cache"},
    )
