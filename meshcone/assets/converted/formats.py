"""The formats that are converted: how they are known, and which extra reads them."""

from __future__ import annotations

from dataclasses import dataclass

from meshcone.assets.archive.directory import STORED, Directory


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
USD = Converted("usd", "a USD file", "model/vnd.usd", "pxr", "usd", 1.0)
USDZ = Converted("usdz", "a USDZ file", "model/vnd.usdz+zip", "pxr", "usd", 1.0)
SUFFIXES = frozenset({".step", ".stp", ".3mf", ".usd", ".usda", ".usdc", ".usdz"})
_MARKS = ((b"ISO-10303-21", STEP), (b"#usda", USD), (b"PXR-USDC", USD))
_ALIGNED = 64
_USD_LAYERS = (".usd", ".usda", ".usdc")


def recognise_converted(data: bytes) -> Converted | None:
    """The format of a file that is not an archive, by its first bytes."""
    start = data[:4096].removeprefix(b"\xef\xbb\xbf").lstrip()
    return next((kind for mark, kind in _MARKS if start.startswith(mark)), None)


def recognise_package(directory: Directory) -> Converted | None:
    """The format of an archive that is one file to its users, by what is in it."""
    names = {name.lower() for name in directory.files}
    if "[content_types].xml" in names and any(name.endswith(".model") for name in names):
        return THREE_MF
    # The first file of a USDZ is the scene, stored at a multiple of 64 bytes (its specification,
    # "Layout"). Any other archive of a USD file is one like those of other meshes.
    first = min(directory.files.values(), key=lambda entry: entry.local, default=None)
    if first is None or first.method != STORED or first.start % _ALIGNED:
        return None
    return USDZ if first.name.lower().endswith(_USD_LAYERS) else None
