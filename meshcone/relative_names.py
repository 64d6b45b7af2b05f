"""Names that a mesh has for the files beside it."""

from __future__ import annotations

import posixpath
import re
import unicodedata
from collections.abc import Mapping
from urllib.parse import unquote

from meshcone.text import is_text

NAME_LENGTH = 255
"""Characters of a name, from elsewhere, that are taken: what common file systems allow."""

_SCHEME_OR_DRIVE = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")


def from_uri(uri: str) -> str | None:
    """The file that a relative URI means, percent-decoded; None as :func:`inside` has it."""
    return None if _SCHEME_OR_DRIVE.match(uri) else inside(unquote(uri))


def inside(path: str) -> str | None:
    """A path within the mesh's folder, in one spelling: ``./a//b/../c.bin`` is ``a/c.bin``.

    Backslashes separate as well: Windows exporters write them and viewers take them so.

    Returns:
        The path; None if it is absolute, leads out of the folder, or means no file.
    """
    path = path.replace("\\", "/")
    if path.startswith("/") or _SCHEME_OR_DRIVE.match(path) or "\0" in path or not is_text(path):
        return None
    parts: list[str] = []
    for part in path.split("/"):
        if part == "..":
            if not parts:
                return None
            parts.pop()
        elif part not in ("", "."):
            parts.append(part)
    name = "/".join(parts)
    # What stood behind "./" may be a drive all the same.
    is_file = bool(parts) and not path.endswith("/") and not _SCHEME_OR_DRIVE.match(name)
    return name if is_file else None


def sent_beyond(uri: str, sent: Mapping[str, bytes]) -> str | None:
    """The name of a file that a relative URI means beyond the mesh's folder, if it was sent.

    Only an archive has such files: nobody else can send one.
    """
    path = posixpath.normpath(unquote(uri).replace("\\", "/"))
    return sent_as(path, sent) if path.startswith("../") and path in sent else None


def sent_as(name: str, sent: Mapping[str, bytes]) -> str | None:
    """The name under which a file was sent: its own, or the only one that ends with it.

    A folder is sent with its own name before those of the files in it. Letters with accents are
    one character or two, as the machine that wrote a name has it.
    """
    spellings = [name, *(unicodedata.normalize(form, name) for form in ("NFC", "NFD"))]
    for each in spellings:
        if each in sent:
            return each
    endings = tuple(f"/{each}" for each in spellings)
    longer = [each for each in sent if each.endswith(endings)]
    return longer[0] if len(longer) == 1 else None
