"""PLY, STL and OFF, read by trimesh: good enough for a reference, never written.

trimesh trusts the sizes a header declares, so they are compared with the file's length
and the limits before it sees a byte.
"""

from __future__ import annotations

import io
import re
import struct
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.base import Asset, NormalsPolicy
from meshcone.assets.limits import LARGEST_COORDINATE, Limits
from meshcone.assets.regions import Regions
from meshcone.assets.weld import weld_surface
from meshcone.errors import InputError

ForeignFormat = Literal["ply", "stl", "off"]

_STL_HEADER = 84
_STL_TRIANGLE = 50
_HEADER = 65_536
_PLY_ELEMENT = re.compile(rb"^element\s+(\w+)\s+(\d{1,18})\s*$", re.MULTILINE)
_OFF_COUNTS = re.compile(rb"\A\s*(?:ST)?C?N?4?n?OFF(?:\s+BINARY)?\s+(\d{1,18})\s+(\d{1,18})")

# What trimesh's three readers raise on damaged files, found by reading and by fuzzing them.
# ModuleNotFoundError: for text that is not UTF-8 it asks for a package it does not require.
_TRIMESH_ERRORS = (
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    UnboundLocalError,
    AssertionError,
    NotImplementedError,
    OverflowError,
    StopIteration,
    EOFError,
    ModuleNotFoundError,
    struct.error,
)


def recognise_foreign(suffix: str, data: bytes) -> ForeignFormat | None:
    """The format of a PLY, STL or OFF file; None if it is none of them."""
    if re.match(rb"ply\s", data):
        return "ply"
    if re.match(rb"\s*(?:ST)?C?N?4?n?OFF\b", data):
        return "off"
    if suffix in {".ply", ".stl", ".off"}:
        return suffix[1:]  # type: ignore[return-value]
    if _binary_stl_triangles(data) is not None or re.match(rb"\s*solid\b[^\n]*\n\s*facet\b", data):
        return "stl"
    return None


def read_foreign(name: str, kind: ForeignFormat, data: bytes, limits: Limits) -> ForeignAsset:
    """Read a reference through trimesh.

    Raises:
        InputError: the file is damaged or holds no surface.
        LimitError: its header declares more than ``limits`` accept.
    """
    _check_declared(kind, data, limits)
    import trimesh  # half a second to import, and most files never need it

    try:
        with np.errstate(all="ignore"):
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type=kind, process=False)
            positions = np.array(mesh.vertices, dtype=np.float64).reshape(-1, 3)
            triangles = np.array(mesh.faces, dtype=np.int64).reshape(-1, 3)
    except _TRIMESH_ERRORS:
        raise InputError(f"the file is not a valid {kind.upper()} mesh") from None
    limits.check("vertices", len(positions), "vertices")
    limits.check("faces", len(triangles), "triangles")
    if not (np.abs(positions) <= LARGEST_COORDINATE).all():
        raise InputError(f"a coordinate is not a number of at most {LARGEST_COORDINATE:g}")
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(positions)):
        raise InputError(f"a face names a vertex that is not among the {len(positions)} given")
    return ForeignAsset(name, kind, positions, triangles)


class ForeignAsset(Asset):
    """A mesh that can serve as a reference only."""

    def __init__(
        self,
        name: str,
        kind: ForeignFormat,
        positions: NDArray[np.float64],
        triangles: NDArray[np.int64],
    ) -> None:
        surface = weld_surface(positions, triangles)
        super().__init__(
            name,
            surface,
            regions=Regions.whole(len(triangles)),
            polygons=len(triangles),
            meshes=1,
            materials=0,
        )
        self.format = kind
        self.media_type = f"model/{kind}"

    def ensure_writable(self, normals: NormalsPolicy = "recompute") -> None:  # noqa: ARG002
        """Always refuse: trimesh keeps too little of these files to write them back.

        Raises:
            InputError: always.
        """
        raise InputError(
            f"{self.format.upper()} files can be a reference, not a source; "
            "send the source as OBJ, glTF or GLB",
            file=self.name,
        )

    def _write(
        self,
        vertices: NDArray[np.float64],  # noqa: ARG002
        normals: NormalsPolicy,  # noqa: ARG002
    ) -> bytes:
        raise AssertionError("ensure_writable refuses every write")


def _check_declared(kind: ForeignFormat, data: bytes, limits: Limits) -> None:
    if kind == "ply":
        header = data[:_HEADER].partition(b"end_header")[0]
        declared = {name: int(count) for name, count in _PLY_ELEMENT.findall(header)}
        vertices, faces = declared.get(b"vertex", 0), declared.get(b"face", 0)
    elif kind == "off":
        without_comments = re.sub(rb"#[^\n]*", b"", data[:_HEADER])
        counts = _OFF_COUNTS.match(without_comments)
        vertices, faces = (int(counts[1]), int(counts[2])) if counts else (0, 0)
    else:
        faces = _binary_stl_triangles(data) or 0
        vertices = 3 * faces
    limits.check("vertices", vertices, "vertices")
    limits.check("faces", faces, "faces")
    if vertices > len(data) or faces > len(data):
        raise InputError(
            f"the header declares {vertices:,} vertices and {faces:,} faces, "
            f"more than fit in a file of {len(data):,} bytes"
        )


def _binary_stl_triangles(data: bytes) -> int | None:
    if len(data) < _STL_HEADER:
        return None
    (count,) = struct.unpack_from("<I", data, 80)
    return count if len(data) == _STL_HEADER + _STL_TRIANGLE * count else None
