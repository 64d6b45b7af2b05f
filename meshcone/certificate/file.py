"""The certificate as a file: what, with the meshes and the report, lets anyone re-check it.

An ``.npz`` archive of plain arrays (no pickles) holding the last round's starting point,
its optimum, the multipliers that are not zero and their tension at each vertex, with a
JSON document naming the files and settings it belongs to. Everything else of the program
is rebuilt from the files.
"""

from __future__ import annotations

import io
import math
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from meshcone.errors import InputError
from meshcone.options import Options
from meshcone.program.answer import FinalProgram
from meshcone.program.tension import vertex_tension
from meshcone.report.report import Matrix
from meshcone.surface.arrays import Floats, Ints

_LARGEST_ARCHIVE = 4 << 30  # bytes, unpacked
# Positions hardly shrink: an archive that unpacks to more than this multiple of itself is a bomb.
_SMALL_ARCHIVE, _LARGEST_RATIO = 1 << 20, 200
# What Python's parser raises at text that is no header of an array.
_UNPARSABLE = (SyntaxError, tokenize.TokenError, MemoryError, TypeError, OverflowError)
# What zipfile and numpy raise at bytes that are no archive of arrays, or a damaged one.
_UNREADABLE = (
    KeyError,
    ValueError,  # pydantic's ValidationError among them
    OSError,
    EOFError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)


class CertificateDocument(BaseModel):
    """What the arrays belong to."""

    model_config = ConfigDict(extra="forbid", frozen=True, serialize_by_alias=True)

    schema_: Literal["meshcone.certificate/1"] = Field("meshcone.certificate/1", alias="schema")
    version: str
    source_sha256: str
    reference_sha256: str
    refined_sha256: str
    source_resources: dict[str, str] = Field(
        default_factory=dict, description="SHA-256 of each file that was sent with the source"
    )
    reference_resources: dict[str, str] = Field(default_factory=dict)
    candidate: str = Field(description="name of the settings that were kept")
    round_index: int = Field(ge=0, description="the last round, counted from 0")
    alignment: Matrix | None = Field(
        description="(4, 4) similarity by which the source was brought to the reference first"
    )
    options: Options


@dataclass(frozen=True)
class CertificateFile:
    """A certificate's contents.

    Attributes:
        document: what it belongs to.
        before: (n, 3) the last round's starting point, in the frame.
        positions: (n, 3) its optimum, in the frame.
        multipliers: by kind of cone: which (j,), and their values (j, dimension).
        tension: (n,) norms of the multipliers at each vertex.
    """

    document: CertificateDocument
    before: Floats
    positions: Floats
    multipliers: Mapping[str, tuple[Ints, Floats]]
    tension: Floats

    @staticmethod
    def of(final: FinalProgram, document: CertificateDocument) -> CertificateFile:
        """Take a certificate from a solved program."""
        return CertificateFile(
            document=document,
            before=final.before,
            positions=final.positions,
            multipliers={e.family.kind: (e.which, e.values) for e in final.multipliers},
            tension=vertex_tension(final.multipliers, len(final.positions)),
        )

    def to_bytes(self) -> bytes:
        """Write the archive; the same certificate gives the same bytes."""
        document = np.array(self.document.model_dump_json())
        buffer = io.BytesIO()
        np.savez_compressed(buffer, allow_pickle=False, document=document, **self._arrays())
        return buffer.getvalue()

    def arrays_equal(self, other: CertificateFile) -> bool:
        """Tell whether two certificates hold the same numbers to the last bit."""
        here, there = self._arrays(), other._arrays()
        return here.keys() == there.keys() and all(
            np.array_equal(here[name], there[name]) for name in here
        )

    def _arrays(self) -> dict[str, Any]:
        """The arrays by their names in the archive, in its order."""
        arrays: dict[str, Any] = {
            "before": self.before,
            "positions": self.positions,
            "tension": self.tension,
        }
        for kind, (which, values) in self.multipliers.items():
            arrays[f"which_{kind}"], arrays[f"values_{kind}"] = which, values
        return arrays


def read_certificate(data: bytes, name: str) -> CertificateFile:
    """Read an archive.

    Raises:
        InputError: it is no certificate, or one with arrays missing or of wrong shape.
    """
    try:
        arrays = _read_arrays(data)
        document = CertificateDocument.model_validate_json(str(arrays.pop("document")))
        certificate = CertificateFile(
            document=document,
            before=_floats(arrays.pop("before")),
            positions=_floats(arrays.pop("positions")),
            tension=_floats(arrays.pop("tension")),
            multipliers=_multipliers(arrays),
        )
    except _UNREADABLE as error:
        raise InputError("this is not a MeshCone certificate", file=name) from error
    count = certificate.tension.size
    shapes = [certificate.before.shape, certificate.positions.shape, certificate.tension.shape]
    if shapes != [(count, 3), (count, 3), (count,)]:
        raise InputError("the certificate's arrays do not fit each other", file=name)
    return certificate


def _read_arrays(data: bytes) -> dict[str, Any]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entries = archive.infolist()
        unpacked = sum(entry.file_size for entry in entries)
        if unpacked > min(_LARGEST_ARCHIVE, _SMALL_ARCHIVE + _LARGEST_RATIO * len(data)):
            raise ValueError("the archive unpacks to more than any certificate holds")
        if len({entry.filename for entry in entries}) < len(entries):
            raise ValueError("the archive holds two arrays of the same name")
        for entry in entries:
            _check_header(archive, entry)
        return {entry.filename.removesuffix(".npy"): _read(archive, entry) for entry in entries}


def _check_header(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> None:
    """Compare what an array's header declares with the bytes there are, before reading them."""
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError("the archive is compressed in a way no certificate is")
    with archive.open(entry) as file:
        if np.lib.format.read_magic(file) != (1, 0):  # later versions allow headers of 4 GiB
            raise ValueError("the array's header has another version")
        try:
            shape, _, dtype = np.lib.format.read_array_header_1_0(file)
        except _UNPARSABLE as error:
            raise ValueError("the array's header cannot be read") from error
        there = entry.file_size - file.tell()
    if dtype.kind not in "iufU" or min(shape, default=0) < 0:
        raise ValueError("the array is of a kind no certificate holds")
    if math.prod(shape) * dtype.itemsize != there:
        raise ValueError("the array's header declares other data than there are")


def _read(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Any:
    with archive.open(entry) as file:
        return np.lib.format.read_array(file, allow_pickle=False)


def _multipliers(arrays: dict[str, Any]) -> dict[str, tuple[Ints, Floats]]:
    kinds = [key.removeprefix("which_") for key in arrays if key.startswith("which_")]
    multipliers = {
        kind: (_indices(arrays.pop(f"which_{kind}")), _floats(arrays.pop(f"values_{kind}")))
        for kind in kinds
    }
    if arrays:
        raise ValueError(f"the archive holds an array of no meaning: {min(arrays)}")
    return multipliers


def _indices(array: Any) -> Ints:
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise ValueError("the array holds no indices")
    return np.asarray(array, dtype=np.int64)


def _floats(array: Any) -> Floats:
    converted = np.asarray(array, dtype=np.float64)
    if not np.all(np.isfinite(converted)):
        raise ValueError("the array holds values that are not finite")
    return converted
