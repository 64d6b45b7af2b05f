"""A PLY, STL or OFF file as an asset."""

from __future__ import annotations

import re
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.astray import astray
from meshcone.assets.base import Asset
from meshcone.assets.content import Content
from meshcone.assets.foreign.carried import Carried
from meshcone.assets.foreign.carried_off import carried_by_off
from meshcone.assets.foreign.carried_ply import carried_by_ply
from meshcone.assets.foreign.content import one_mesh
from meshcone.assets.foreign.divide import ForeignTriangles
from meshcone.assets.foreign.divide_off import carries_more, divided_off
from meshcone.assets.foreign.divide_ply import carries_properties, divided_ply, require_divisible
from meshcone.assets.foreign.divide_stl import divided_stl, has_attributes
from meshcone.assets.foreign.off import read_off
from meshcone.assets.foreign.ply import read_ply
from meshcone.assets.foreign.polygons import Polygons
from meshcone.assets.foreign.stl import is_binary_stl, is_text_stl, read_stl
from meshcone.assets.foreign.whole import has_no_sign, lengthened
from meshcone.assets.limits import Limits
from meshcone.assets.normals import recompute_normals
from meshcone.assets.points.asset import PointAsset
from meshcone.assets.policy import WritePolicy
from meshcone.assets.polygons import triangulate
from meshcone.assets.regions import Regions
from meshcone.assets.weld import weld_surface
from meshcone.errors import InputError, naming
from meshcone.notices import Code, Notice
from meshcone.surface.charts import Charts
from meshcone.surface.subdivision import Subdivision
from meshcone.text import BYTE_ORDER_MARK

ForeignFormat = Literal["ply", "stl", "off"]

_READERS = {"ply": read_ply, "stl": read_stl, "off": read_off}


def recognise_foreign(suffix: str, data: bytes) -> ForeignFormat | None:
    """The format of a PLY, STL or OFF file; None if it is none of them."""
    text = data.removeprefix(BYTE_ORDER_MARK)
    if re.match(rb"ply\s", text):
        return "ply"
    if re.match(rb"(?:\s|#[^\n]*\n)*+(?:ST)?C?N?4?n?OFF(?![A-Za-z_])", text):
        return "off"
    if suffix in {".ply", ".stl", ".off"}:
        return suffix[1:]  # type: ignore[return-value]
    if is_binary_stl(data) or is_text_stl(text):
        return "stl"
    return None


def read_foreign(name: str, kind: ForeignFormat, data: bytes, limits: Limits) -> Asset:
    """Read a PLY, STL or OFF file; a PLY without faces is one of points.

    Raises:
        InputError: the file is damaged or holds no surface, with the line or byte at fault.
        LimitError: it has, or declares, more than ``limits`` accept.
    """
    polygons = _READERS[kind](_unmarked(data), limits)
    if kind == "ply" and not len(polygons.sizes) and len(polygons.positions):
        places = polygons.places
        normals = (
            None
            if places is None or places.normals is None
            else places.normals.read(_unmarked(data))
        )
        return PointAsset(name, kind, polygons.positions, normals)
    return ForeignAsset(name, kind, data, polygons, limits)


def _unmarked(data: bytes) -> bytes:
    """The file with blanks for a byte order mark, so that everything stays where it is."""
    if not data.startswith(BYTE_ORDER_MARK):
        return data
    return b" " * len(BYTE_ORDER_MARK) + data[len(BYTE_ORDER_MARK) :]


class ForeignAsset(Asset):
    """A mesh of polygons alone.

    Writing replaces the numbers of vertices that moved, in the type or with the digits the file
    has, and of their normals. An STL's facets get the normals of the triangles they have become,
    on the side where they were; those that are zero stay zero.
    """

    def __init__(
        self, name: str, kind: ForeignFormat, data: bytes, polygons: Polygons, limits: Limits
    ) -> None:
        enough = polygons.sizes >= 3
        nowhere = ~np.asarray(np.isfinite(polygons.positions).all(axis=1))
        owners = np.repeat(np.arange(len(enough)), polygons.sizes)
        lost = np.zeros(len(enough), dtype=bool)
        lost[owners[nowhere[polygons.corners]]] = True
        whole = enough & ~lost
        corners = polygons.corners[np.repeat(whole, polygons.sizes)]
        sizes = polygons.sizes[whole]
        warnings = list(astray(int(nowhere.sum()), int(lost.sum()), "faces"))
        if not enough.all():
            words = f"{np.count_nonzero(~enough)} faces with fewer than 3 corners; ignored"
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
        self._data, self._limits = data, limits
        self._places = polygons.places
        starts = np.cumsum(sizes) - sizes
        listed = np.repeat(np.arange(len(sizes)), sizes - 2)
        self._rows = np.flatnonzero(whole)[listed]
        self._corners = triangles - starts[listed][:, None]
        self.format = self._kind = kind
        self.media_type = f"model/{kind}"

    @cached_property
    def precision_as_listed(self) -> NDArray[np.float64]:
        """See :meth:`Asset.precision_as_listed`: by the type or the digits of its numbers."""
        if self._places is None:
            return super().precision_as_listed
        return self._places.positions.steps(self._text, self.positions)

    def _read_content(self) -> Content:
        triangles = self.triangles
        carried = Carried()
        if self._kind == "ply":
            where = triangles, self._rows, self._corners
            carried = carried_by_ply(self._text, self._limits, *where)
        elif self._kind == "off" and self._places is not None:
            carried = carried_by_off(self._text, self._limits, triangles, self._rows)
        return one_mesh(triangles, carried)

    def ensure_writable(self, policy: WritePolicy | None = None) -> None:
        """Check that it is known where the vertices are in the file, and what its normals mean.

        Raises:
            InputError: rows of a PLY up to its vertices have lists, the lines of an OFF are
                not those of its vertices and faces, or normals to be written are numbers
                without a sign.
        """
        if self._places is None:
            why = (
                "lists stand among the vertices of this PLY or before them"
                if self._kind == "ply"
                else "this OFF does not have a line for each vertex and each face"
            )
            raise InputError(f"{why}: it can be a reference, not a source", file=self.name)
        normals = self._places.normals
        if normals is None or policy is None or policy.normals == "keep":
            return
        if has_no_sign(normals.whole(normals.read(self._text))):
            raise InputError(
                "expected normals nx, ny, nz with a sign, found unsigned integers, in which nobody "
                "says how a direction is coded: store them as floats, or leave them as they are "
                "with 'normals': 'keep'",
                file=self.name,
                place="element vertex",
            )

    def ensure_divisible(self, policy: WritePolicy | None = None) -> None:
        """Check that what can be written can be divided too.

        Raises:
            InputError: a PLY has strips of triangles alone, or rows without all that its header
                declares.
        """
        self.ensure_writable(policy)
        if self._kind == "ply":
            with naming(self.name):
                require_divisible(self._text, self._limits)

    def charts(self) -> Charts:
        """See :meth:`Asset.charts`; faces that carry anything of their own keep their sides."""
        if self._kind == "ply":
            keeps = carries_properties(self._text, self._limits)
        else:
            keeps = {"off": carries_more, "stl": has_attributes}[self._kind](self._text)
        return super().charts().keeping(np.full(len(self.faces), keeps))

    def _chart_corners(self) -> NDArray[np.int64]:
        return self.weld[self.triangles] if self._kind == "stl" else self.triangles

    def _divide(self, subdivision: Subdivision) -> bytes:
        triangles = ForeignTriangles(
            self._rows, self._corners, self._surface.triangles, self._surface.kept
        )
        if self._kind == "ply":
            return self._marked(divided_ply(self._text, self._limits, triangles, subdivision))
        if self._kind == "off":
            return self._marked(divided_off(self._text, triangles, subdivision))
        return self._marked(divided_stl(self._text, triangles, subdivision, self.positions))

    def _write(self, vertices: NDArray[np.float64], policy: WritePolicy) -> bytes:
        positions, moved = self._scattered(vertices)
        if not moved.any() or self._places is None:
            return self._data
        data = bytearray(self._text)
        # Text that grows moves what comes after it; each kind of row is found anew.
        rows = np.flatnonzero(moved)
        self._places.positions.write(data, rows, positions[rows])
        if self._places.normals is not None and policy.normals == "recompute":
            stored = self._places.normals.read(self._text)
            renew = self._facet_normals if self._places.by_facet else self._vertex_normals
            normals, renewed = renew(stored, positions, vertices, moved, policy)
            rows = np.flatnonzero(renewed)
            if len(rows):
                normals = lengthened(normals, stored, self._places.normals.whole(stored))
                self._places.normals.write(data, rows, normals[rows])
        return self._marked(bytes(data))

    @property
    def _text(self) -> bytes:
        return _unmarked(self._data)

    def _marked(self, written: bytes) -> bytes:
        if not self._data.startswith(BYTE_ORDER_MARK):
            return written
        return BYTE_ORDER_MARK + written[len(BYTE_ORDER_MARK) :]

    def _facet_normals(
        self,
        stored: NDArray[np.float64],
        positions: NDArray[np.float64],
        vertices: NDArray[np.float64],  # noqa: ARG002
        moved: NDArray[np.bool_],
        policy: WritePolicy,  # noqa: ARG002
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        before, after = (_normals(each.reshape(-1, 3, 3)) for each in (self.positions, positions))
        side = np.where((before * stored).sum(axis=1) < 0, -1.0, 1.0)
        known = np.isfinite(stored).all(axis=1) & (stored != 0).any(axis=1) & after.any(axis=1)
        return after * side[:, None], known & moved.reshape(-1, 3).any(axis=1)

    def _vertex_normals(
        self,
        stored: NDArray[np.float64],
        positions: NDArray[np.float64],  # noqa: ARG002
        vertices: NDArray[np.float64],
        moved: NDArray[np.bool_],  # noqa: ARG002
        policy: WritePolicy,
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        corners = self._surface.triangles[self._surface.kept]
        return recompute_normals(
            self.vertices, vertices, self.faces, corners, self.weld, stored, policy.selected
        )


def _normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 3) unit normals of (m, 3, 3) triangles; zero where one has no area."""
    with np.errstate(invalid="ignore"):  # facets that are nowhere
        areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(areas, axis=1, keepdims=True)
    unit: NDArray[np.float64] = np.divide(
        areas, lengths, out=np.zeros_like(areas), where=lengths > 0
    )
    return unit
