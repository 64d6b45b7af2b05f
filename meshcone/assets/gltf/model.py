"""A glTF taken apart: document, buffers, scene, and the container they came in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessors
from meshcone.assets.gltf.affine import restore_points
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.container import Container, join_glb
from meshcone.assets.gltf.document import Document, parse_document
from meshcone.assets.gltf.scene import Scene, read_scene
from meshcone.assets.gltf.write import BufferEditor
from meshcone.assets.limits import Limits


@dataclass(frozen=True)
class Model:
    """A document with everything needed to read and write it.

    Attributes:
        container: the GLB it is in, or None.
    """

    container: Container | None
    document: Document
    accessors: Accessors
    scene: Scene
    limits: Limits

    @staticmethod
    def read(
        data: bytes, container: Container | None, resources: Mapping[str, bytes], limits: Limits
    ) -> Model:
        """Parse a document and read its scene. Raises as ``read_gltf`` does."""
        document = parse_document(data if container is None else container.json, limits)
        buffers = Buffers(document, container.binary if container else None, resources)
        return Model.of(container, document, buffers, limits)

    @staticmethod
    def of(
        container: Container | None, document: Document, buffers: Buffers, limits: Limits
    ) -> Model:
        """Read a document's scene."""
        accessors = Accessors(document, buffers, limits)
        return Model(
            container, document, accessors, read_scene(document, accessors, limits), limits
        )

    def rebuilt(self, document: Document, buffers: Buffers) -> Model:
        """The same model with another document and buffers."""
        return Model.of(self.container, document, buffers, self.limits)

    def store_positions(
        self, editor: BufferEditor, positions: NDArray[np.float64], moved: NDArray[np.bool_]
    ) -> None:
        """Write raw vertices through the inverse of their nodes' transforms.

        Args:
            editor: takes the changes.
            positions: (r, 3) world positions.
            moved: (r,) which of them to write.
        """
        for block in self.scene.blocks:
            rows = np.flatnonzero(moved[block.rows])
            world = positions[block.rows][rows]
            editor.store(block.accessor, rows, restore_points(block.placement.matrix, world))

    def to_bytes(self, editor: BufferEditor) -> bytes:
        """The file, with what an editor has changed."""
        changed = editor.changed_buffers()
        text = editor.new_json(self.document, changed)
        if self.container is None:
            return text.encode()
        buffers = self.accessors.buffers
        in_file = (data for index, data in changed.items() if buffers[index].source == "binary")
        return join_glb(self.container, text, next(in_file, buffers.binary))
