"""The documentation under /help, where `make site` has built it into this package.

A checkout or a wheel that was made without it has neither the pages nor a link to them.
"""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import dataclass, field
from pathlib import Path

from fastapi import Response
from fastapi.responses import RedirectResponse

from service.api.routing import HeadRouter
from service.problems import ProblemError, problem

BUILT = Path(__file__).parent / "site"

_MEDIA_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".png": "image/png",
    ".svg": "image/svg+xml",
}
_INLINE = re.compile(rb"<script>(.*?)</script>", re.DOTALL)
# The style sheet that the site's script gives to its search, as it stands in the script.
_STYLE = re.compile(rb"var \w+='(\.[^'\\]{1000,})'")


@dataclass(frozen=True)
class Documentation:
    """The files of a built site.

    Attributes:
        folder: where they are.
        names: their paths in it, with slashes; nothing else is ever opened.
        styles: what its policy allows as style sheets besides files, as sources.
    """

    folder: Path
    names: frozenset[str] = field(init=False)
    styles: str = field(init=False)

    def __post_init__(self) -> None:
        """Look which files there are."""
        found = (path for path in self.folder.rglob("*") if path.suffix in _MEDIA_TYPES)
        names = frozenset(path.relative_to(self.folder).as_posix() for path in found)
        scripts = [(self.folder / each).read_bytes() for each in names if each.endswith(".js")]
        object.__setattr__(self, "names", names)
        object.__setattr__(self, "styles", _sources(b"\n".join(sorted(scripts)), _STYLE))

    def __bool__(self) -> bool:
        """Whether the site has been built."""
        return "index.html" in self.names

    def answer(self, path: str) -> Response:
        """A file of the site; a folder stands for the page in it.

        Raises:
            ProblemError: there is no such file.
        """
        name = f"{path}index.html" if path == "" or path.endswith("/") else path
        if name not in self.names:
            if f"{path}/index.html" in self.names:
                return RedirectResponse(f"/help/{path}/")
            raise ProblemError(problem("not-found", "there is no such page of the documentation"))
        data = (self.folder / name).read_bytes()
        headers = {"Cache-Control": "no-cache"}
        if name.endswith(".html"):
            headers["Content-Security-Policy"] = self._policy(data)
        return Response(data, headers=headers, media_type=_MEDIA_TYPES[Path(name).suffix])

    def _policy(self, page: bytes) -> str:
        """Only what this server sends; besides files, what is in the page or a script, by its hash.

        The search runs in a worker, which the site's own script starts from a blob.
        """
        return "; ".join(
            [
                "default-src 'none'",
                f"script-src 'self'{_sources(page, _INLINE)}",
                f"style-src 'self'{self.styles}",
                "img-src 'self' data:",
                "connect-src 'self'",
                "worker-src 'self' blob:",
                "base-uri 'none'",
                "form-action 'none'",
                "frame-ancestors 'none'",
            ]
        )


def _sources(text: bytes, what: re.Pattern[bytes]) -> str:
    """Every match's content as a source of a policy."""
    digests = (hashlib.sha256(content).digest() for content in what.findall(text))
    return "".join(f" 'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)


def documentation_router(documentation: Documentation) -> HeadRouter:
    """The routes of the documentation; none where it was not built."""
    router = HeadRouter(include_in_schema=False)
    if not documentation:
        return router

    @router.get("/help")
    def entrance() -> Response:
        return RedirectResponse("/help/")

    @router.get("/help/{path:path}")
    def file(path: str) -> Response:
        return documentation.answer(path)

    return router
