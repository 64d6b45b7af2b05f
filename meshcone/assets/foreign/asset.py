"""A PLY, STL or OFF file as an asset that can be read only."""

from __future__ import annotations

import re
from typing import Literal

import numpy as np

from meshcone.assets.base import Asset
from meshcone.assets.foreign.off import read_off
from meshcone.assets.foreign.ply import read_ply
from meshcone.assets.foreign.polygons import Polygons
from meshcone.assets.foreign.stl import is_binary_stl, is_text_stl, read_stl
from meshcone.assets.limits import Limits
from meshcone.assets.polygons import triangulate
from meshcone.assets.regions import Regions
from meshcone.assets.weld import weld_surface
from meshcone.errors import InputError
from meshcone.notices import Code, Notice

ForeignFormat = Literal["ply", "stl", "off"]

_READERS = {"ply": read_ply, "stl": read_stl, "off": read_off}


def recognise_foreign(suffix: str, data: bytes) -> ForeignFormat | None:
    """The format of a PLY, STL or OFF file; None if it is none of them."""
    if re.match(rb"ply\s", data):
        return "ply"
    if re.match(rb"(?:\s|#[^\n]*\n)*+(?:ST)?C?N?4?n?OFF(?![A-Za-z_])", data):
        return "off"
    if suffix in {".ply", ".stl", ".off"}:
        return suffix[1:]  # type: ignore[return-value]
    if is_binary_stl(data) or is_text_stl(data):
        return "stl"
    return None


def read_foreign(name: str, kind: ForeignFormat, data: bytes, limits: Limits) -> ForeignAsset:
    """Read a reference.

    Raises:
        InputError: the file is damaged or holds no surface, with the line or byte at fault.
        LimitError: it has, or declares, more than ``limits`` accept.
    """
    return ForeignAsset(name, kind, _READERS[kind](data, limits))


class ForeignAsset(Asset):
    """A mesh that can serve as a reference only."""

    def __init__(self, name: str, kind: ForeignFormat, polygons: Polygons) -> None:
        whole = polygons.sizes >= 3
        corners = polygons.corners[np.repeat(whole, polygons.sizes)]
        sizes = polygons.sizes[whole]
        warnings = []
        if not whole.all():
            words = f"{np.count_nonzero(~whole)} faces with fewer than 3 corners; ignored"
            warnings.append(Notice(Code.FACES_TOO_FEW_CORNERS, words))
        triangles, fanned = triangulate(polygons.positions[corners], sizes)
        if fanned:
            words = f"{fanned} large concave polygons were split as if they were convex"
            warnings.append(Notice(Code.FACES_CONCAVE, words))
        super().__init__(
            name,
            weld_surface(polygons.positions, corners[triangles]),
            regions=Regions.whole(len(triangles)),
            polygons=len(sizes),
            meshes=1,
            materials=0,
            warnings=tuple(warnings),
        )
        self.format = kind
        self.media_type = f"model/{kind}"

    def ensure_writable(self, *_: object) -> None:
        """Always refuse: too little of these files is kept to write them back.

        Raises:
            InputError: always.
        """
        raise InputError(
            f"{self.format.upper()} files can be a reference, not a source; "
            "send the source as OBJ, glTF or GLB",
            file=self.name,
        )

    def _write(self, *_: object) -> bytes:
        raise AssertionError("ensure_writable refuses every write")
