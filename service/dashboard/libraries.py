"""Scripts of others, out of the Python packages they are installed with.

None of them is copied into this project, and none comes from another host.
"""

from __future__ import annotations

import zipfile
from importlib.util import find_spec
from pathlib import Path

from meshcone.errors import InternalError

_THREE_BEGINS = "/**\n * @license\n * Copyright 2010-2022 Three.js Authors"


def three_js() -> bytes:
    """three.js r140 (MIT), as trimesh carries it for its own viewer: a script that sets ``THREE``.

    The place is not part of trimesh's public interface. So the version of trimesh is bounded, and
    tests say what is taken. ``docs/architecture.md`` says what else was looked at.

    Raises:
        InternalError: it is not.
    """
    archive = _package("trimesh") / "resources" / "templates" / "viewer.zip"
    try:
        with zipfile.ZipFile(archive) as templates:
            page = templates.read("viewer.html.template").decode()
        begin = page.index(_THREE_BEGINS)
        # A licence comment, then all of the library in one line.
        end = page.index("\n", page.index("*/", begin) + len("*/\n"))
    except (OSError, KeyError, ValueError, zipfile.BadZipFile):
        raise InternalError("the installed trimesh carries no three.js where it used to") from None
    return page[begin:end].encode()


def swagger_file(name: str) -> bytes:
    """A file of Swagger UI (Apache-2.0), as ``fastapi-swagger`` carries it.

    Raises:
        InternalError: there is none of that name.
    """
    try:
        return (_package("fastapi_swagger") / "resources" / name).read_bytes()
    except OSError:
        raise InternalError(f"the installed fastapi-swagger has no '{name}'") from None


def _package(name: str) -> Path:
    # Found without being imported: trimesh alone would double the time the front end starts in.
    spec = find_spec(name)
    if spec is None or not spec.submodule_search_locations:
        raise InternalError(f"the package '{name}' is not installed")
    return Path(spec.submodule_search_locations[0])
