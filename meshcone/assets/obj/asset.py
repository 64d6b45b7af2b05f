"""An OBJ file as an asset."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.base import Asset
from meshcone.assets.content import Content
from meshcone.assets.divisions import Division
from meshcone.assets.limits import Limits
from meshcone.assets.normals import recompute_normals
from meshcone.assets.obj.content import ObjTriangles, read_content
from meshcone.assets.obj.divide import divided_obj
from meshcone.assets.obj.divisions import face_divisions
from meshcone.assets.obj.faces import ObjFaces, read_faces
from meshcone.assets.obj.numbers import read_normals, read_positions
from meshcone.assets.obj.plain import plain_obj
from meshcone.assets.obj.regions import face_regions
from meshcone.assets.obj.scan import ObjLines, count_lines, scan_lines
from meshcone.assets.obj.write import number_style, replaced_vectors
from meshcone.assets.policy import WritePolicy
from meshcone.assets.polygons import triangulate
from meshcone.assets.regions import Regions
from meshcone.assets.weld import WeldedSurface, weld_surface
from meshcone.errors import InputError
from meshcone.notices import Code, Notice
from meshcone.surface.subdivision import Subdivision

_SAMPLED = 2_000  # vertices whose digits tell how precise a file is
_UTF16_MARKS = (b"\xfe\xff", b"\xff\xfe")


def read_obj(name: str, data: bytes, resources: Mapping[str, bytes], limits: Limits) -> ObjAsset:
    """Read the polygons of an OBJ file; its curves, lines, points and materials stay text.

    Raises:
        InputError: with the line at fault.
        LimitError: more vertices or triangles than ``limits`` accepts.
    """
    if data.startswith(_UTF16_MARKS):
        raise InputError("the text is UTF-16; OBJ files are ASCII or UTF-8", place="line 1")
    limits.check("lines", count_lines(data), "lines")
    lines = scan_lines(data)
    for rows, what in ((lines.vertices, "vertices"), (lines.normals, "normals")):
        place = lines.place(int(rows[-1])) if len(rows) else None
        limits.check("vertices", len(rows), what, place)
    positions = read_positions(lines)
    faces = read_faces(lines, limits)
    corners, fanned = triangulate(positions[faces.vertices], faces.sizes)
    warnings = faces.warnings
    if fanned:
        words = f"{fanned} large concave polygons were split as if they were convex"
        warnings += (Notice(Code.FACES_CONCAVE, words),)
    surface = weld_surface(positions, faces.vertices[corners])
    regions = face_regions(lines, np.repeat(faces.rows, faces.sizes - 2))
    return ObjAsset(name, data, resources, lines, faces, corners, surface, regions, warnings)


class ObjAsset(Asset):
    """An OBJ file.

    Writing changes coordinates on v lines and directions on vn lines. A vn line that
    several corners share cannot follow all of them, and giving each its own would renumber
    the faces: it takes the mean of what they need. Corners whose triangles stay where they
    were vote for the direction it had.
    """

    format = "obj"
    media_type = "model/obj"

    def __init__(
        self,
        name: str,
        data: bytes,
        resources: Mapping[str, bytes],
        lines: ObjLines,
        faces: ObjFaces,
        corners: NDArray[np.int64],
        surface: WeldedSurface,
        regions: Regions,
        warnings: tuple[Notice, ...],
    ) -> None:
        super().__init__(
            name,
            surface,
            polygons=len(faces.sizes),
            regions=regions,
            meshes=len(set(lines.names(lines.objects)) or set(lines.names(lines.groups))) or 1,
            materials=len(set(lines.names(lines.materials))),
            warnings=warnings,
        )
        self._data = data
        self._style = number_style(lines, lines.vertices, _SAMPLED)
        self._resources = resources
        self._corner_normals = faces.normals[corners]
        self._corner_texcoords = faces.texcoords[corners]
        self._statements = np.repeat(faces.rows, faces.sizes - 2)

    @cached_property
    def precision_as_listed(self) -> NDArray[np.float64]:
        """See :meth:`Asset.precision_as_listed`: by the digits that the file writes."""
        return self._style.steps(self.positions)

    def _read_content(self) -> Content:
        return read_content(scan_lines(self._data), self._drawn(), self._resources)

    def _drawn(self) -> ObjTriangles:
        return ObjTriangles(
            statements=self._statements,
            vertices=self._surface.triangles,
            texcoords=self._corner_texcoords,
            normals=self._corner_normals,
        )

    def plain(self) -> bytes:
        """What the file draws, as triangles in words that every reader takes alike."""
        libraries = self.content().libraries
        library = next((name for name, sent in libraries.items() if sent), None)
        return plain_obj(scan_lines(self._data), self._drawn(), self.positions, library)

    def _divisions(self) -> dict[str, Division]:
        return face_divisions(scan_lines(self._data), self._statements[self._surface.kept])

    def _write(self, vertices: NDArray[np.float64], policy: WritePolicy) -> bytes:
        positions, moved = self._scattered(vertices)
        if not moved.any():
            return self._data
        # Keeping every line of every asset alive would cost several times its file's size.
        lines = scan_lines(self._data)
        style = number_style(lines, lines.vertices).resolving(vertices)
        statements = replaced_vectors(
            lines, lines.vertices[moved], self.positions[moved], positions[moved], style
        )
        if policy.normals == "recompute" and (self._corner_normals >= 0).any():
            statements |= self._new_normals(lines, vertices, policy.selected)
        return lines.replaced(statements)

    def ensure_divisible(self, policy: WritePolicy | None = None) -> None:
        """See :meth:`Asset.ensure_divisible`: every OBJ can be."""

    def _chart_corners(self) -> NDArray[np.int64]:
        columns = self._surface.triangles, self._corner_texcoords, self._corner_normals
        rows = np.stack([each.ravel() for each in columns], axis=1)
        _, numbers = np.unique(rows, axis=0, return_inverse=True)
        return np.asarray(numbers.reshape(-1, 3), dtype=np.int64)

    def _divide(self, subdivision: Subdivision) -> bytes:
        unknown = {Code.TEXCOORDS_UNKNOWN, Code.NORMALS_UNKNOWN}
        return divided_obj(
            scan_lines(self._data),
            self._drawn(),
            self._surface.kept,
            subdivision,
            unknown=any(warning.code in unknown for warning in self.warnings),
        )

    def _new_normals(
        self,
        lines: ObjLines,
        vertices: NDArray[np.float64],
        selected: NDArray[np.bool_] | None,
    ) -> dict[int, bytes]:
        stored = read_normals(lines)
        directions, changed = self._shared_normals(stored, vertices)
        if selected is not None:
            used = self._corner_normals[self._surface.kept][~selected]
            changed[used[used >= 0]] = False
        style = number_style(lines, lines.normals).for_normals()
        return replaced_vectors(
            lines, lines.normals[changed], stored[changed], directions[changed], style
        )

    def _shared_normals(
        self, stored: NDArray[np.float64], vertices: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """(s, 3) new direction of each vn statement, and (s,) which of them change."""
        corner_vertices = self._surface.triangles[self._surface.kept]
        corner_normals = self._corner_normals[self._surface.kept]
        has_normal = corner_normals >= 0
        if not has_normal.any():  # only faces without area have normals
            return stored, np.zeros(len(stored), dtype=bool)
        keys = corner_vertices * len(stored) + corner_normals
        pairs, inverse = np.unique(keys[has_normal], return_inverse=True)
        corners = np.full(corner_normals.shape, -1, dtype=np.int64)
        corners[has_normal] = inverse
        pair_vertices, pair_normals = np.divmod(pairs, len(stored))
        wanted, renewed = recompute_normals(
            self.vertices,
            vertices,
            self.faces,
            corners,
            self.weld[pair_vertices],
            stored[pair_normals],
        )
        length = np.linalg.norm(wanted, axis=1, keepdims=True)
        votes = np.divide(wanted, length, out=np.zeros_like(wanted), where=length > 0)
        votes[~np.isfinite(votes)] = 0.0
        mean: NDArray[np.float64] = np.stack(
            [np.bincount(pair_normals, votes[:, axis], len(stored)) for axis in range(3)], axis=1
        )
        changed = np.bincount(pair_normals, renewed, len(stored)) > 0
        size = np.linalg.norm(mean, axis=1)
        changed &= size > 1e-6  # users that cancel out leave no direction to write
        mean[changed] /= size[changed, None]
        return mean, changed
