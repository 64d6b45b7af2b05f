"""The surface of a glTF's scene: every placed mesh, in world space, as one set of triangles."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors, decode
from meshcone.assets.gltf.choice import scenes_left
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.nodes import Placement, Placements, place_meshes
from meshcone.assets.gltf.notices import Findings, called, scene_notices
from meshcone.assets.gltf.pose import Pose
from meshcone.assets.gltf.primitives import Primitive, PrimitiveReader
from meshcone.assets.gltf.skins import PoseReader
from meshcone.assets.limits import LARGEST_COORDINATE, Limits
from meshcone.assets.policy import ReadPolicy
from meshcone.errors import InputError
from meshcone.notices import Notice


@dataclass(frozen=True)
class Block:
    """The positions of one accessor at one node: a run of raw vertices.

    Primitives of a mesh that share the accessor, and what deforms it, share the block.

    Attributes:
        deformers: equal where skins and morph targets show equal positions at equal places.
    """

    placement: Placement
    accessor: Accessor
    pose: Pose
    start: int
    deformers: Hashable = ()

    @property
    def rows(self) -> slice:
        """Its raw vertices."""
        return slice(self.start, self.start + self.accessor.count)


@dataclass(frozen=True)
class PlacedPrimitive:
    """A primitive at one node; ``triangles`` are (k, 3) raw vertices, outward side out."""

    primitive: Primitive
    block: int
    triangles: NDArray[np.int64]


@dataclass(frozen=True)
class Scene:
    """All that the default scene draws with triangles.

    Attributes:
        positions: (r, 3) raw vertices in world space, block after block; finite where a triangle
            uses them.
    """

    blocks: list[Block]
    primitives: list[PlacedPrimitive]
    positions: NDArray[np.float64]
    warnings: tuple[Notice, ...]

    @property
    def triangles(self) -> NDArray[np.int64]:
        """(k, 3) triangles of all primitives."""
        empty = [np.zeros((0, 3), dtype=np.int64)]
        return np.concatenate([placed.triangles for placed in self.primitives] or empty)

    @property
    def stored(self) -> NDArray[np.int64]:
        """(r,) which vertex of the file each raw vertex is: several nodes may place the same."""
        counts = {block.accessor.index: block.accessor.count for block in self.blocks}
        starts = dict(zip(counts, np.cumsum([0, *counts.values()]).tolist(), strict=False))
        rows = [
            starts[block.accessor.index] + np.arange(block.accessor.count) for block in self.blocks
        ]
        return np.concatenate([np.zeros(0, dtype=np.int64), *rows])


def read_scene(
    document: Document, accessors: Accessors, limits: Limits, policy: ReadPolicy
) -> Scene:
    """Read the triangles of every mesh the default scene places.

    Args:
        document: the document.
        accessors: its accessors.
        limits: caps on sizes.
        policy: what of the document is read.

    Raises:
        InputError: something the scene uses is malformed, or a position is beyond
            ``LARGEST_COORDINATE``.
        LimitError: more vertices or triangles than ``limits`` accept, instances counted.
    """
    return _SceneBuilder(document, accessors, limits, policy).build()


class _SceneBuilder:
    def __init__(
        self, document: Document, accessors: Accessors, limits: Limits, policy: ReadPolicy
    ) -> None:
        self._policy = policy
        self._poses: PoseReader | None = None
        self._document = document
        self._accessors = accessors
        self._limits = limits
        self._reader = PrimitiveReader(document, accessors, limits)
        self._mesh_elements = document.root.children("meshes")
        self._meshes: dict[int, list[Primitive]] = {}
        self._local: dict[int, NDArray[np.float64]] = {}
        self._blocks: list[Block] = []
        self._block_numbers: dict[tuple[int, ...], int] = {}
        self._placed: list[PlacedPrimitive] = []
        self._shaded: set[tuple[int, int]] = set()
        self._vertices = 0
        self._normals = 0
        self._faces = 0
        self._primitives_read = 0
        self._astray = 0
        self._undrawn = 0

    def build(self) -> Scene:
        placements = place_meshes(self._document.root, self._accessors, self._limits, self._policy)
        if self._policy.pose == "rest":
            self._poses = PoseReader(
                self._document, self._accessors, self._limits, placements.worlds
            )
        for placement in placements.shown:
            for primitive in self._mesh(placement.mesh):
                self._place(placement, primitive)
        positions = self._positions()
        return Scene(self._blocks, self._placed, positions, self._warnings(placements))

    def _mesh(self, index: int) -> list[Primitive]:
        if index not in self._meshes:
            elements = self._mesh_elements[index].children("primitives")
            self._primitives_read += len(elements)
            place = self._mesh_elements[index].place("primitives")
            self._limits.check("meshes", self._primitives_read, "primitives", place)
            found = map(self._reader.read, elements)
            self._meshes[index] = [primitive for primitive in found if primitive is not None]
        return self._meshes[index]

    def _place(self, placement: Placement, primitive: Primitive) -> None:
        place = self._document.root.place("nodes") + f"/{placement.node}"
        self._limits.check("meshes", len(self._placed) + 1, "primitives drawn", place)
        self._faces += len(primitive.triangles)
        self._limits.check("faces", self._faces, "triangles in the scene", place)
        number = self._block_number(placement, primitive)
        self._count_normals(number, primitive)
        local = primitive.triangles[:, ::-1] if placement.mirrored else primitive.triangles
        self._placed.append(PlacedPrimitive(primitive, number, local + self._blocks[number].start))

    def _block_number(self, placement: Placement, primitive: Primitive) -> int:
        accessor = primitive.position
        deformers = self._poses.deformers(placement, primitive) if self._poses else ()
        instance = -1 if placement.instance is None else placement.instance
        indices = (-1 if each is None else each.index for each in deformers)
        key = (placement.node, instance, accessor.index, *indices)
        if key not in self._block_numbers:
            start = self._vertices
            self._vertices += accessor.count
            place = self._document.root.place("nodes") + f"/{placement.node}"
            self._limits.check("vertices", self._vertices, "vertices in the scene", place)
            self._block_numbers[key] = len(self._blocks)
            pose = self._pose_of(placement, primitive)
            deformed = tuple(each and each.content for each in deformers)
            self._blocks.append(Block(placement, accessor, pose, start, deformed))
        return self._block_numbers[key]

    def _pose_of(self, placement: Placement, primitive: Primitive) -> Pose:
        if self._poses is None:
            return Pose.rigid(placement.matrix)
        return self._poses.pose(placement, primitive)

    def _count_normals(self, block: int, primitive: Primitive) -> None:
        """Bound what writing needs: any number of normals may belong to one block's vertices."""
        normal = primitive.normal
        if normal is None or (block, normal.index) in self._shaded:
            return
        self._shaded.add((block, normal.index))
        self._normals += normal.count
        place = normal.element.pointer
        self._limits.check("vertices", self._normals, "normals in the scene", place)

    def _positions(self) -> NDArray[np.float64]:
        positions = np.empty((self._vertices, 3))
        finite = np.empty(self._vertices, dtype=bool)
        for block in self._blocks:
            local = self._local_positions(block)
            finite[block.rows] = np.isfinite(local).all(axis=1)
            with np.errstate(over="ignore", invalid="ignore"):
                positions[block.rows] = block.pose.place(local)
        self._astray = int(np.count_nonzero(~finite))
        if self._astray:
            self._leave_out(finite)
        used = np.zeros(self._vertices, dtype=bool)
        for placed in self._placed:
            used[placed.triangles] = True
        far = used & ~(np.abs(positions) <= LARGEST_COORDINATE).all(axis=1)
        if far.any():
            row = int(np.flatnonzero(far)[0])
            block = next(each for each in self._blocks if row < each.rows.stop)
            raise InputError(
                f"vertex {row - block.start} is not at finite coordinates of at most "
                f"{LARGEST_COORDINATE:g}",
                place=block.accessor.element.pointer,
            )
        return positions

    def _leave_out(self, finite: NDArray[np.bool_]) -> None:
        """Drop triangles with a corner that is nowhere: graphics hardware does not draw them."""
        for number, placed in enumerate(self._placed):
            drawn = finite[placed.triangles].all(axis=1)
            self._undrawn += int(np.count_nonzero(~drawn))
            self._placed[number] = replace(placed, triangles=placed.triangles[drawn])

    def _local_positions(self, block: Block) -> NDArray[np.float64]:
        accessor = block.accessor
        if accessor.index not in self._local:
            stored = self._accessors.read(accessor)
            self._local[accessor.index] = decode(stored, accessor.normalized)
        return self._local[accessor.index]

    def _warnings(self, placements: Placements) -> tuple[Notice, ...]:
        found = Findings(
            placements=placements,
            scenes=scenes_left(self._document.root, self._policy),
            skinned=self._unposed(lambda placed: bool(placed.primitive.joints)),
            morphed=self._unposed(lambda placed: bool(placed.primitive.targets)),
            empty=self._reader.empty,
            ragged=self._reader.ragged,
            astray=self._astray,
            undrawn=self._undrawn,
        )
        return scene_notices(self._document, found)

    def _unposed(self, deforms: Callable[[PlacedPrimitive], bool]) -> set[int]:
        """Meshes that are read as they are stored, though something deforms them."""
        if self._policy.pose == "rest":
            return set()
        blocks = self._blocks
        found = (blocks[each.block].placement for each in self._placed if deforms(each))
        return {placement.mesh for placement in found}


def mesh_name(meshes: list[Element], index: int) -> str:
    """How messages call a mesh."""
    return called("mesh", meshes[index])
