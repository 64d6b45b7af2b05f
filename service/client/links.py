"""Files that a service is to fetch, as people write them where a path could stand."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import PurePosixPath

from pydantic import ValidationError

from meshcone.errors import InputError
from service.api.request_schemas import LinkedFile, OutputPlace
from worker.transfers.places import last_name

_SCHEMES = ("https://", "http://", "s3://")
_SHA256 = re.compile(r"[0-9a-fA-F]{64}")
_GLTF = (".gltf", ".glb")
_WRITTEN = (*_GLTF, ".obj", ".ply", ".stl", ".off", ".zip")


def is_link(text: str) -> bool:
    """Whether a text is the URL of a file, and no path on this machine."""
    return text.lower().startswith(_SCHEMES)


def link_to(url: str, *, secret: str | None = None, sha256: str | None = None) -> LinkedFile:
    """A file at a URL; of a glTF with what it names, as a file of this machine is sent.

    Args:
        url: where it is.
        secret: the name of a secret of the service to fetch it with.
        sha256: what is found there must have this hash, in hexadecimal digits.

    Raises:
        InputError: it is no URL that a service could be asked for, or the hash is none.
    """
    if sha256 is not None and not _SHA256.fullmatch(sha256):
        raise InputError(
            f"'{sha256[:80]}' is not a SHA-256: expected 64 hexadecimal digits",
            file=shown_link(url),
        )
    try:
        suffix = PurePosixPath(last_name(url)).suffix.lower()
        return LinkedFile(
            url=url,
            sha256=sha256 and sha256.lower(),
            authorization=secret,
            resources="relative" if suffix in _GLTF else None,
        )
    except (ValidationError, ValueError):
        raise InputError("is not a URL that a service can fetch", file=shown_link(url)) from None


def source_name(source: str) -> str:
    """The file name of a source as a command line has it; empty where only a fetch will tell."""
    if not is_link(source):
        return PurePosixPath(source).name
    with suppress(ValueError):
        name = last_name(source)
        if PurePosixPath(name).suffix.lower() in _WRITTEN:  # and no script's, such as .php
            return name
    return ""


def place_at(url: str) -> OutputPlace:
    """A place for a result.

    Raises:
        InputError: it is no URL that a service could be asked to put something to.
    """
    try:
        return OutputPlace(url=url)
    except ValidationError:
        file = shown_link(url)[:200] or "''"
        raise InputError("is not a URL that a service can put a result to", file=file) from None


def shown_link(url: str) -> str:
    """A URL as messages and reports name it: what follows a question mark may be a secret."""
    return url.partition("?")[0]
