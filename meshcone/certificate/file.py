"""The certificate as a file: what, with the meshes and the report, lets anyone re-check it.

An ``.npz`` archive of plain arrays (no pickles). It holds how the refined surface and the
reference were divided into pieces and what bounds each, and of the last round its starting
point, its optimum, the multipliers that are not zero and their tension at each vertex. Where
faces of the source were divided before, it says how. A JSON document names the files and settings
it belongs to. Everything else is rebuilt from the files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from meshcone.certificate.archive import LARGEST_ARCHIVE, ArchiveError, read_arrays, write_arrays
from meshcone.certificate.division import DivisionRecord
from meshcone.errors import InputError
from meshcone.json_text import DuplicateNameError, NotFiniteError, parse_json
from meshcone.options import Options
from meshcone.program.answer import FinalProgram
from meshcone.program.tension import vertex_tension
from meshcone.quality.deviation.leaves import Leaves
from meshcone.report.report import Matrix
from meshcone.surface import Subdivision
from meshcone.surface.arrays import Floats, Ints

Schema = Literal["meshcone.certificate/1", "meshcone.certificate/2"]
_SCHEMA: Schema = "meshcone.certificate/2"
_DIRECTIONS = ("extra", "missing")
_DIVISION = "division_"
# Bytes, unpacked. A piece takes 23 in either direction (half a cut of 13, half a leaf of up to
# 33); a batch may be made beyond what was asked for, which the bytes of no mesh have room for. A
# vertex or face takes its positions, its leaves, and the multipliers of the cones it has.
_OF_NO_MESH, _OF_ELEMENT, _OF_PIECE = 8 << 20, 1 << 10, 64
_OF_CHARACTER = 4


class CertificateDocument(BaseModel):
    """What the arrays belong to."""

    model_config = ConfigDict(extra="forbid", frozen=True, serialize_by_alias=True)

    schema_: Schema = Field(_SCHEMA, alias="schema")
    version: str
    source_sha256: str
    reference_sha256: str
    refined_sha256: str
    source_resources: dict[str, str] = Field(
        default_factory=dict, description="SHA-256 of each file that was sent with the source"
    )
    reference_resources: dict[str, str] = Field(default_factory=dict)
    candidate: str = Field(description="name of the settings that were kept")
    round_index: int | None = Field(
        ge=0, description="the last round, counted from 0; absent where the source was kept"
    )
    alignment: Matrix | None = Field(
        description="(4, 4) similarity by which the source was brought to the reference first"
    )
    options: Options


@dataclass(frozen=True)
class Closeness:
    """What proves how far two surfaces go from each other; see :class:`Leaves`.

    Attributes:
        extra: how the refined surface's faces are bounded by the reference's.
        missing: how the reference's are bounded by the refined surface's.
    """

    extra: Leaves
    missing: Leaves


@dataclass(frozen=True)
class CertificateFile:
    """A certificate's contents.

    Where the source was kept as it was there is no round, and n is 0.

    Attributes:
        document: what it belongs to.
        before: (n, 3) the last round's starting point, in the frame.
        positions: (n, 3) its optimum, in the frame.
        multipliers: by kind of cone: which (j,), and their values (j, dimension).
        tension: (n,) norms of the multipliers at each vertex.
        closeness: None where none was asked for, and in certificates of the first version.
        division: how faces of the source were divided before the last round; None where none
            was. Vertices are then those of the divided source.
    """

    document: CertificateDocument
    before: Floats
    positions: Floats
    multipliers: Mapping[str, tuple[Ints, Floats]]
    tension: Floats
    closeness: Closeness | None = None
    division: DivisionRecord | None = None

    @staticmethod
    def of(
        final: FinalProgram,
        document: CertificateDocument,
        closeness: Closeness | None,
        division: Subdivision | None = None,
    ) -> CertificateFile:
        """Take a certificate from a solved program, a proven deviation and a division."""
        return CertificateFile(
            document=document,
            before=final.before,
            positions=final.positions,
            multipliers={e.family.kind: (e.which, e.values) for e in final.multipliers},
            tension=vertex_tension(final.multipliers, len(final.positions)),
            closeness=closeness,
            division=None if division is None else DivisionRecord.of(division),
        )

    @staticmethod
    def of_kept(document: CertificateDocument, closeness: Closeness) -> CertificateFile:
        """Make a certificate of a source that was kept: of closeness alone."""
        nowhere = np.empty((0, 3))
        return CertificateFile(document, nowhere, nowhere, {}, np.empty(0), closeness)

    def to_bytes(self) -> bytes:
        """Write the archive; the same certificate gives the same bytes."""
        document = np.array(self.document.model_dump_json())
        return write_arrays({"document": document, **self._arrays()})

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
        for direction in _DIRECTIONS if self.closeness is not None else ():
            leaves: Leaves = getattr(self.closeness, direction)
            for name, array in leaves.arrays().items():
                arrays[f"{direction}_{name}"] = array
        for name, array in self.division.arrays().items() if self.division is not None else ():
            arrays[f"{_DIVISION}{name}"] = array
        return arrays


def most_bytes(vertices: int, faces: int, options: Options) -> int:
    """Bound what a certificate unpacks to, in bytes.

    Args:
        vertices: of both meshes together.
        faces: of both, likewise.
        options: that they were refined with.
    """
    document = _OF_CHARACTER * len(options.model_dump_json())
    elements = _OF_ELEMENT * (vertices + faces)
    return _OF_NO_MESH + document + elements + _OF_PIECE * options.deviation.pieces


def read_certificate(data: bytes, name: str, most: int = LARGEST_ARCHIVE) -> CertificateFile:
    """Read an archive.

    Args:
        data: the archive.
        name: what messages call it.
        most: bytes that it may unpack to; see :func:`most_bytes`.

    Raises:
        InputError: it is no certificate, or one with arrays missing or of wrong shape or type.
    """
    try:
        return _certificate(read_arrays(data, min(most, LARGEST_ARCHIVE)))
    except ArchiveError as error:
        words = f"this is not a MeshCone certificate: {error}"
        raise InputError(words, file=name) from error


def _certificate(arrays: dict[str, Any]) -> CertificateFile:
    text = str(_taken(arrays, "document"))
    try:
        parse_json(text)  # the model reads over names that are there twice
        document = CertificateDocument.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"])) or "the whole of it"
        raise ArchiveError(f"its document cannot be used, at {place:.60}") from error
    except (DuplicateNameError, NotFiniteError) as error:
        raise ArchiveError(f"its document cannot be used: {error}") from error
    except (ValueError, RecursionError) as error:
        raise ArchiveError("its document cannot be used, at the whole of it") from error
    certificate = CertificateFile(
        document=document,
        before=_floats(arrays, "before"),
        positions=_floats(arrays, "positions"),
        tension=_floats(arrays, "tension"),
        closeness=_closeness(arrays),
        division=_division(arrays),
        multipliers=_multipliers(arrays),
    )
    if arrays:
        raise ArchiveError(f"it holds an unknown array, {min(arrays)!a:.60}")
    count = certificate.tension.size
    shapes = [certificate.before.shape, certificate.positions.shape, certificate.tension.shape]
    if shapes != [(count, 3), (count, 3), (count,)]:
        raise ArchiveError("its arrays do not fit each other")
    return certificate


def _closeness(arrays: dict[str, Any]) -> Closeness | None:
    found: dict[str, dict[str, Any]] = {direction: {} for direction in _DIRECTIONS}
    for direction in _DIRECTIONS:
        for key in [key for key in arrays if key.startswith(f"{direction}_")]:
            array = _taken(arrays, key)
            if array.dtype.kind == "f":
                _require_finite(array, key)
            found[direction][key.removeprefix(f"{direction}_")] = array
    if not any(found.values()):
        return None
    try:
        return Closeness(*(Leaves.of_arrays(found[direction]) for direction in _DIRECTIONS))
    except InputError as error:
        raise ArchiveError(str(error)) from error


def _division(arrays: dict[str, Any]) -> DivisionRecord | None:
    names = [name for name in arrays if name.startswith(_DIVISION)]
    if not names:
        return None
    found = {name.removeprefix(_DIVISION): _taken(arrays, name) for name in names}
    try:
        return DivisionRecord.of_arrays(found)
    except InputError as error:
        raise ArchiveError(str(error)) from error


def _multipliers(arrays: dict[str, Any]) -> dict[str, tuple[Ints, Floats]]:
    kinds = [key.removeprefix("which_") for key in arrays if key.startswith("which_")]
    return {
        kind: (_indices(arrays, f"which_{kind}"), _floats(arrays, f"values_{kind}"))
        for kind in kinds
    }


def _taken(arrays: dict[str, Any], name: str) -> Any:
    if name not in arrays:
        raise ArchiveError(f"it has no array '{name}'")
    return arrays.pop(name)


def _indices(arrays: dict[str, Any], name: str) -> Ints:
    array = _taken(arrays, name)
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise ArchiveError(f"the array {name!a:.60} holds no indices")
    return np.asarray(array, dtype=np.int64)


def _floats(arrays: dict[str, Any], name: str) -> Floats:
    array = _taken(arrays, name)
    if array.dtype.kind != "f":
        raise ArchiveError(f"the array {name!a:.60} holds no floating-point numbers")
    converted = np.asarray(array, dtype=np.float64)
    _require_finite(converted, name)
    return converted


def _require_finite(array: Floats, name: str) -> None:
    if not np.all(np.isfinite(array)):
        raise ArchiveError(f"the array {name!a:.60} holds values that are not finite")
