"""What every mesh file looks like from the inside of the engine."""

from __future__ import annotations

import abc
from functools import cached_property
from typing import Any
from weakref import ReferenceType, ref

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.archive import Packed
from meshcone.assets.content import Content, Draw, Mesh, Node, Primitive
from meshcone.assets.counts import AssetCounts
from meshcone.assets.divisions import Division, nearest_division, select_faces
from meshcone.assets.policy import WritePolicy
from meshcone.assets.regions import Regions
from meshcone.assets.weld import WeldedSurface
from meshcone.errors import InputError, naming
from meshcone.files import MeshFile
from meshcone.notices import Code, Notice
from meshcone.options import Options, SelectOptions
from meshcone.surface.charts import Charts
from meshcone.surface.subdivision import Subdivision

_DEFAULT = WritePolicy()


class Asset(abc.ABC):
    """A file that was read: its welded surface, and the file itself to write back into.

    Immutable: every array is read-only.

    Attributes:
        name: the file's name as its sender knows it.
        format: obj, glb, gltf, ply, stl or off.
        media_type: the format's registered media type.
        positions: (r, 3) raw vertices in world space, in model units; those that no face uses
            need not be finite.
        weld: (r,) welded vertex of each raw vertex, -1 where no face uses it.
        vertices: (n, 3) welded vertices in world space.
        faces: (m, 3) triangles over the welded vertices.
        regions: (m,) material and group of each face, as an index into ``region_names``.
        region_names: what a message calls each region.
        warnings: what a reader should know about the way the file was understood.
        file: the mesh and the files beside it; where they came in an archive, taken out of it.
        packed: the archive they came in, if they did.
        is_points: whether the file has points and no faces.
        tolerance: how far the surface may lie from the one that the file means, in model units.
    """

    format: str
    media_type: str
    _data: bytes
    file: MeshFile
    packed: Packed | None = None
    tolerance: float = 0.0
    is_points: bool = False

    def __init__(
        self,
        name: str,
        surface: WeldedSurface,
        *,
        regions: Regions,
        polygons: int,
        meshes: int,
        materials: int,
        warnings: tuple[Notice, ...] = (),
    ) -> None:
        if len(surface.faces) == 0:
            found = "its faces have no area" if len(surface.triangles) else "it has no faces"
            raise InputError(f"the file holds no surface: {found}", file=name)
        self.name = name
        self.positions = surface.positions
        self.weld = surface.weld
        self.vertices = surface.vertices
        self.faces = surface.faces
        self.regions = regions.labels[surface.kept]
        self.regions.setflags(write=False)
        self.region_names = regions.names
        self.warnings = warnings
        self._surface = surface
        self._content: ReferenceType[Content] | None = None
        self._counts = AssetCounts(
            vertices=len(surface.positions),
            welded_vertices=len(surface.vertices),
            faces=len(surface.triangles),
            polygons=polygons,
            meshes=meshes,
            materials=materials,
        )

    def read_from(self, file: MeshFile, packed: Packed | None = None) -> Asset:
        """Know the file this was read from, and the archive that was in, if it was.

        Args:
            file: the mesh and the files beside it.
            packed: the archive.
        """
        self.file, self.packed = file, packed
        if packed is not None:
            self.media_type = "application/zip"
        return self

    def counts(self) -> AssetCounts:
        """The file's sizes."""
        return self._counts

    def __getstate__(self) -> dict[str, Any]:
        """What goes to another process; what is read at need is read there anew."""
        return self.__dict__ | {"_content": None}

    def content(self) -> Content:
        """All that the file holds besides its surface; read anew where nobody has it any more.

        It can keep every line of a text file in memory.
        """
        content = None if self._content is None else self._content()
        if content is None:
            content = self._read_content()
            self._content = ref(content)
        return content

    def _read_content(self) -> Content:
        rows = np.arange(len(self._surface.triangles))
        primitive = Primitive(None, "triangles", len(self.positions), ("POSITION",))
        return Content(
            nodes=(Node("", None, 1, np.eye(4), mesh=0),),
            meshes=(Mesh("", (primitive,)),),
            draws=(Draw(0, 0, 0, None, rows),),
        )

    @property
    def collapsed(self) -> int:
        """How many triangles of the file are not among the faces: two of their corners coincide."""
        return len(self._surface.triangles) - len(self.faces)

    @cached_property
    def precision(self) -> NDArray[np.float64]:
        """(n,) how far apart the numbers are that the file can hold at each welded vertex.

        In model units; 0 where they are those of a float64.
        """
        used = self.weld >= 0
        found = np.zeros(len(self.vertices))
        np.maximum.at(found, self.weld[used], self.precision_as_listed[used])
        found.setflags(write=False)
        return found

    @cached_property
    def precision_as_listed(self) -> NDArray[np.float64]:
        """(r,) the same of each raw vertex."""
        return np.zeros(len(self.positions))

    @property
    def triangles(self) -> NDArray[np.int64]:
        """(k, 3) triangles over raw vertices, all that the file lists."""
        return self._surface.triangles

    @property
    def kept(self) -> NDArray[np.int64]:
        """(m,) the row of ``triangles`` that each face came from."""
        return self._surface.kept

    def policy(self, options: Options) -> WritePolicy:
        """What options mean for writing this file.

        Raises:
            InputError: nothing has a name that is asked for, or nothing is left to move.
        """
        return WritePolicy(
            normals=options.normals,
            instances=options.instances,
            draco=options.draco,
            meshopt=options.meshopt,
            selected=self._selected(options.select),
        )

    def _selected(self, chosen: SelectOptions) -> NDArray[np.bool_] | None:
        if not chosen.given():
            return None
        with naming(self.name):
            selected = select_faces(self._divisions(), chosen, len(self.faces))
            fixed = WritePolicy(selected=selected).fixed_vertices(self.faces, len(self.vertices))
            if fixed.all():
                raise InputError(
                    "option 'select': nothing can move, for every vertex of the parts it names "
                    "is shared with others"
                )
        return selected

    def ensure_writable(self, policy: WritePolicy = _DEFAULT) -> None:  # noqa: B027
        """Check, without new positions yet, that ``patched`` will be able to write.

        Formats that are always writable have nothing to check.

        Raises:
            InputError: saying what in the file stands in the way.
        """

    def changes(self, policy: WritePolicy, written: Asset) -> tuple[Notice, ...]:  # noqa: ARG002
        """What was changed of the file besides positions and normals.

        Args:
            policy: what the file was written under.
            written: what was written.
        """
        return ()

    def patched(self, vertices: NDArray[np.float64], policy: WritePolicy = _DEFAULT) -> bytes:
        """Write the same file with its welded vertices somewhere else.

        Every raw vertex takes the position of its welded vertex; raw vertices no face uses
        stay. Where nothing moved, the file's bytes are kept, and if nothing moved at all
        the answer is the input, byte for byte. A file that came in an archive goes back into
        it.

        Args:
            vertices: (n, 3) new world-space positions of ``self.vertices``.
            policy: what else may change. Vertices it does not select stay.

        Raises:
            InputError: the format, or something in this file, cannot be written back.
            ValueError: ``vertices`` has another shape or is not finite.
        """
        vertices = np.asarray(vertices, dtype=np.float64)
        if vertices.shape != self.vertices.shape:
            raise ValueError(f"expected {self.vertices.shape} vertices, found {vertices.shape}")
        if not np.isfinite(vertices).all():
            raise ValueError("vertices must be finite")
        with naming(self.name):
            self.ensure_writable(policy)
            fixed = policy.fixed_vertices(self.faces, len(self.vertices))
            data = self._write(np.where(fixed[:, None], self.vertices, vertices), policy)
            return self._around(data)

    def _around(self, data: bytes) -> bytes:
        """What is sent back: the file, or the archive it came in with it."""
        return data if self.packed is None else self.packed.around(data)

    @abc.abstractmethod
    def _write(self, vertices: NDArray[np.float64], policy: WritePolicy) -> bytes: ...

    def divided(self, subdivision: Subdivision) -> bytes:
        """Write the same file with its faces divided, and nothing moved.

        Every new vertex lies on the face or edge it divides, and has each of its attributes
        interpolated there. Vertices that were there keep theirs, to the last bit where the
        type they are stored in can hold what lies between them. Faces that are not divided
        stay as they are, and where none is the answer is the input, byte for byte.

        Args:
            subdivision: of ``self.faces``; it tiles them and conforms.

        Raises:
            InputError: the format, or something in this file, cannot be divided.
            ValueError: the subdivision is not one of these faces.
        """
        if subdivision.sources != len(self.faces) or not subdivision.is_tiling():
            raise ValueError("the subdivision does not tile the faces of the file")
        if not subdivision.divided.any():
            return self._around(self._data)
        self.ensure_divisible()
        with naming(self.name):
            return self._around(self._divide(subdivision))

    def twins(self) -> NDArray[np.int64]:
        """(m,) of each face, the first that is the same triangle of the file; mostly itself."""
        return np.arange(len(self.faces), dtype=np.int64)

    def divided_alike(self, subdivision: Subdivision) -> Subdivision:
        """Divide every face as its twin is divided, which is how :meth:`divided` can write it."""
        return subdivision

    def charts(self) -> Charts:
        """What joins faces beyond their place, and their texture coordinates.

        Raises:
            InputError: a part of the file that says nothing of its surface cannot be read.
        """
        drawn = np.full(len(self.triangles), -1, dtype=np.int64)
        planes: dict[str, NDArray[np.float64]] = {}
        for number, draw in enumerate(self.content().draws):
            drawn[draw.rows] = number
            for name, attribute in draw.attributes.items():
                if name.startswith("TEXCOORD_"):
                    empty = np.full((len(drawn), 3, 2), np.nan)
                    plane = planes.setdefault(name, empty)
                    plane[draw.rows] = attribute.at_corners(as_stored=True)[:, :, :2]
        keys = np.stack([drawn[self.kept], self.regions], axis=1)
        _, labels = np.unique(keys, axis=0, return_inverse=True)
        return Charts(
            self._chart_corners()[self.kept],
            np.where(keys[:, 0] < 0, -1, labels.ravel()).astype(np.int64),
            tuple(planes[name][self.kept] for name in sorted(planes)),
        )

    def _chart_corners(self) -> NDArray[np.int64]:
        """(k, 3) vertices of the file at the corners of ``triangles``, with all they have."""
        return self.triangles

    def division_notices(self, subdivision: Subdivision) -> tuple[Notice, ...]:
        """What :meth:`divided` changes of the file besides its faces."""
        swapped = np.count_nonzero(subdivision.swapped)
        if not swapped:
            return ()
        words = (
            f"{swapped:,} faces have corners in several faces of the source, for diagonals were "
            "swapped; texture coordinates are what they were at every vertex, and between vertices "
            "of these faces they are interpolated anew"
        )
        return (Notice(Code.WRITING_DIAGONALS, words),)

    def ensure_divisible(self, policy: WritePolicy = _DEFAULT) -> None:  # noqa: ARG002
        """Check, without a subdivision yet, that ``divided`` can write this format.

        Args:
            policy: how what is divided will be written.

        Raises:
            InputError: it cannot.
        """
        raise InputError(
            f"faces of {self.format.upper()} files are not divided: detail needs an OBJ, GLB, "
            "glTF, PLY, STL or OFF file",
            file=self.name,
        )

    def _divide(self, subdivision: Subdivision) -> bytes:
        raise NotImplementedError

    def parts(self, by: str) -> tuple[tuple[str, ...], NDArray[np.int64]]:
        """The parts of the surface, by node, mesh, material or group.

        A format that has no such division is divided by the nearest one that it has: objects
        of an OBJ are its nodes and meshes, and its groups where it has no objects. What has
        none is one part without a name.

        Returns:
            The parts' names, and (m,) the part of each face.
        """
        nearest = nearest_division(self._divisions(), by)
        if nearest is None:
            return ("",), np.zeros(len(self.faces), dtype=np.int64)
        return nearest.part_names(), nearest.labels

    def _divisions(self) -> dict[str, Division]:
        """The ways the file is divided, by the name of their option."""
        return {}

    def _scattered(
        self, vertices: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """(r, 3) new raw positions, and (r,) which of them differ from the file's."""
        used = self.weld >= 0
        positions = np.where(used[:, None], vertices[self.weld], self.positions)
        return positions, used & (positions != self.positions).any(axis=1)
