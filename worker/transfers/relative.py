"""The files that a fetched glTF names and that are beside it."""

from __future__ import annotations

from typing import IO
from urllib.parse import quote, urljoin, urlsplit

from meshcone.errors import InputError, LimitError
from meshcone.local_files import names_beside
from meshcone.relative_names import NAME_LENGTH
from meshcone.text import is_line
from worker.outbound.addresses import URL_LENGTH
from worker.transfers.places import is_in_bucket

RELATIVE_FILES = 256  # of one mesh
NAMES_BYTES = 64 * 1024  # of one mesh: the ledger keeps them with its job
_JSON_BYTES = 8 * 1024**2  # read into memory, where JSON takes many times its size
_BINARY = b"glTF"
_HEADER = 20  # bytes before the JSON of a GLB (glTF 2.0, section 4.4)


def names_in(file: IO[bytes]) -> list[str]:
    """The names, below its own folder, of what an open glTF or GLB names; each once.

    What is no glTF names nothing: whoever reads it says what is wrong with it.

    Raises:
        InputError: a name is too long, or is not one line.
        LimitError: its JSON is too long to look for names in, or it has too many.
    """
    file.seek(0)
    data = file.read(_HEADER + _JSON_BYTES + 1)
    size = len(data)
    if data.startswith(_BINARY):
        size = int.from_bytes(data[_HEADER - 8 : _HEADER - 4], "little")
    if size > _JSON_BYTES:
        raise LimitError(
            f"the glTF's JSON has {size} bytes, and names are looked for in up to {_JSON_BYTES}: "
            "give the files that it names as resources of their own"
        )
    names = list(dict.fromkeys(names_beside(data)))
    if len(names) > RELATIVE_FILES:
        raise LimitError(
            f"the glTF names {len(names)} files, more than the {RELATIVE_FILES} that are fetched"
        )
    for name in names:
        if len(name) > NAME_LENGTH or not is_line(name):
            raise InputError(
                f"the glTF names {name[:100]!r}: a name must be one line of up to {NAME_LENGTH} "
                "characters"
            )
    size = sum(len(name.encode()) for name in names)
    if size > NAMES_BYTES:
        raise LimitError(
            f"the names in the glTF have {size} bytes together, more than {NAMES_BYTES}"
        )
    return names


def beside(url: str, name: str) -> str:
    """The URL of a file in the folder of another, spelled as the other's; it has no query.

    Raises:
        InputError: it is too long.
    """
    if is_in_bucket(url):
        found = f"{url.rpartition('/')[0]}/{name}"
    else:
        parts = urlsplit(url)
        folder = parts.path.rpartition("/")[0]
        found = f"{parts.scheme}://{parts.netloc}{folder}/{quote(name)}"
    if len(found) > URL_LENGTH:
        raise InputError(
            f"the glTF names '{name[:100]}', whose URL has {len(found)} characters: up to "
            f"{URL_LENGTH} can be fetched"
        )
    return found


def joined(url: str, reference: str) -> str:
    """The URL that a reference means beside another, as RFC 3986, section 5.2 has it.

    Raises:
        ValueError: it is none.
    """
    parts = urlsplit(reference)
    if not parts.scheme and not parts.netloc and parts.path and not parts.path.startswith("/"):
        # Python would drop the empty folders of a URL; "/." keeps a first one from being a host.
        folder = urlsplit(url).path.rpartition("/")[0]
        reference = f"/.{folder}/{reference}"
    return urljoin(url, reference)
