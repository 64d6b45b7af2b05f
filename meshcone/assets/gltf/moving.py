"""What of a scene a policy lets move."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor
from meshcone.assets.gltf.primitives import Primitive
from meshcone.assets.gltf.scene import Block, PlacedPrimitive, Scene
from meshcone.assets.policy import WritePolicy
from meshcone.assets.weld import WeldedSurface


@dataclass(frozen=True)
class Moving:
    """The part of a scene that is written.

    Attributes:
        scene: the scene.
        rows: (r,) raw vertices that may move.
        shaded: (p,) primitives of the scene whose shading may change.
        with_shading: whether normals and tangents are written.
        together: meshes that are moved once for all nodes that use them.
    """

    scene: Scene
    rows: NDArray[np.bool_]
    shaded: NDArray[np.bool_]
    with_shading: bool
    together: frozenset[int] = frozenset()

    @staticmethod
    def of(
        scene: Scene,
        surface: WeldedSurface,
        policy: WritePolicy,
        together: frozenset[int] = frozenset(),
    ) -> Moving:
        """Apply a policy to a scene and the surface welded from it."""
        fixed = policy.fixed_vertices(surface.faces, len(surface.vertices))
        rows = surface.weld >= 0
        rows[rows] = ~fixed[surface.weld[rows]]
        selected = np.zeros(len(surface.triangles), dtype=bool)
        selected[surface.kept] = True if policy.selected is None else policy.selected
        ends = np.cumsum([len(placed.triangles) for placed in scene.primitives])
        counts = np.concatenate([[0], np.cumsum(selected)])[np.concatenate([[0], ends])]
        shaded = np.diff(counts) > 0
        return Moving(scene, rows, shaded, policy.normals == "recompute", together)

    def home(self, block: Block) -> Hashable:
        """What a block has to itself: a place of its mesh, or the mesh at all its places."""
        placement = block.placement
        if placement.mesh in self.together:
            return placement.mesh
        return placement.node, placement.instance

    def identity(self, block: Block) -> Hashable:
        """Equal for blocks that hold the same vertices: in one place, and deformed alike."""
        return self.home(block), block.accessor.content, block.deformers

    def moves(self, block: Block) -> bool:
        """Whether some vertex of a block may move."""
        return bool(self.rows[block.rows].any())

    @property
    def blocks(self) -> list[Block]:
        """Blocks some vertex of which may move."""
        return [block for block in self.scene.blocks if self.moves(block)]

    @property
    def primitives(self) -> list[PlacedPrimitive]:
        """Primitives over such a block."""
        blocks = [self.moves(block) for block in self.scene.blocks]
        return [placed for placed in self.scene.primitives if blocks[placed.block]]

    @property
    def selected(self) -> list[Primitive]:
        """Primitives of the file with a face that is selected."""
        placed = zip(self.scene.primitives, self.shaded.tolist(), strict=True)
        chosen = [each.primitive for each, selected in placed if selected]
        return list({each.element.pointer: each for each in chosen}.values())

    def written(self) -> Iterator[tuple[PlacedPrimitive, str, Accessor]]:
        """Every accessor that is written, with a primitive it belongs to and its attribute."""
        blocks = [self.moves(block) for block in self.scene.blocks]
        for placed, shaded in zip(self.scene.primitives, self.shaded.tolist(), strict=True):
            if not blocks[placed.block]:
                continue
            primitive = placed.primitive
            yield placed, "POSITION", primitive.position
            if shaded and self.with_shading and primitive.normal is not None:
                yield placed, "NORMAL", primitive.normal
                if primitive.tangent is not None:
                    yield placed, "TANGENT", primitive.tangent
