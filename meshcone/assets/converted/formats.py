"""The formats that are converted: how they are known, and which extra reads them."""

from __future__ import annotations

from dataclasses import dataclass

from meshcone.assets.archive.directory import Directory


@dataclass(frozen=True)
class Converted:
    """A format that is converted.

    Attributes:
        name: what reports call it.
        called: what messages call it.
        media_type: its registered media type, or that in use.
        package: what Python imports to read it.
        extra: the extra of this project that brings the package.
        metres: what a unit of the surface is in metres; the reader's GLB is in metres.
    """

    name: str
    called: str
    media_type: str
    package: str
    extra: str
    metres: float


STEP = Converted("step", "a STEP file", "model/step", "cascadio", "cad", 1e-3)
THREE_MF = Converted("3mf", "a 3MF file", "model/3mf", "lib3mf", "3mf", 1.0)
SUFFIXES = frozenset({".step", ".stp", ".3mf"})
_STEP_MARK = b"ISO-10303-21"


def recognise_converted(data: bytes) -> Converted | None:
    """The format of a file that is no archive, by its first bytes."""
    start = data[:4096].removeprefix(b"\xef\xbb\xbf").lstrip()
    return STEP if start.startswith(_STEP_MARK) else None


def recognise_package(directory: Directory) -> Converted | None:
    """The format of an archive that is one file to its users, by what is in it."""
    names = {name.lower() for name in directory.files}
    if "[content_types].xml" in names and any(name.endswith(".model") for name in names):
        return THREE_MF
    return None
