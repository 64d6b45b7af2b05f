"""The scripts and style sheets of the pages: where they come from and how they are sent."""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

from service.dashboard.libraries import swagger_file, three_js

_OWN = Path(__file__).parent / "static"
_MEDIA_TYPES = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
_LIBRARIES: Mapping[str, Callable[[], bytes]] = {
    "three.js": three_js,
    "swagger-ui.js": partial(swagger_file, "swagger-ui-bundle.js"),
    "swagger-ui.css": partial(swagger_file, "swagger-ui.css"),
}


@dataclass(frozen=True)
class StaticFile:
    """A file as it is sent.

    Attributes:
        compressed: by gzip.
        version: of its content; a new content has another one.
    """

    name: str
    data: bytes
    compressed: bytes
    media_type: str
    version: str

    @property
    def url(self) -> str:
        """Where it is, under a name that stands for this content for ever."""
        return f"/static/{self.name}?v={self.version}"


def own_names() -> tuple[str, ...]:
    """The names of the files this project wrote."""
    return tuple(sorted(path.name for path in _OWN.iterdir() if path.suffix in _MEDIA_TYPES))


@cache
def static_file(name: str) -> StaticFile | None:
    """A file by its name; None if there is none."""
    if name in _LIBRARIES:
        data = _LIBRARIES[name]()
    elif name in own_names():
        data = (_OWN / name).read_bytes()
    else:
        return None
    return StaticFile(
        name=name,
        data=data,
        compressed=gzip.compress(data, mtime=0),
        media_type=_MEDIA_TYPES[Path(name).suffix],
        version=hashlib.sha256(data).hexdigest()[:16],
    )


def required(name: str) -> StaticFile:
    """A file that the pages cannot do without."""
    file = static_file(name)
    assert file is not None, name  # noqa: S101 - the names are our own
    return file
