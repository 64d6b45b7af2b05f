"""A glTF taken apart: document, buffers, scene, and the container they came in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.container import Container, join_glb
from meshcone.assets.gltf.document import Document, parse_document
from meshcone.assets.gltf.draco.deflate import bitstream_accessors, deflate, replay
from meshcone.assets.gltf.draco.inflate import inflate
from meshcone.assets.gltf.draco.primitives import DracoPrimitive
from meshcone.assets.gltf.meshopt.compress import compress_again
from meshcone.assets.gltf.meshopt.expand import Expanded, expand
from meshcone.assets.gltf.scene import Scene, read_scene
from meshcone.assets.gltf.write import BufferEditor
from meshcone.assets.limits import Limits
from meshcone.assets.policy import ReadPolicy


@dataclass(frozen=True)
class Compressed:
    """A document as the file has it, and what of it Draco compresses."""

    document: Document
    buffers: Buffers
    primitives: list[DracoPrimitive]

    def to_bytes(self, plain: Model, editor: BufferEditor, came: Expanded | None = None) -> bytes:
        """The file with what an editor has changed of its plain form, compressed again.

        Args:
            plain: its plain form.
            editor: the changes.
            came: what else, by meshopt, is compressed again.
        """
        document, buffers = deflate(
            self.document, self.buffers, self.primitives, editor, plain.limits
        )
        accessors = Accessors(document, buffers, plain.limits)
        again = replay(editor, accessors, bitstream_accessors(self.primitives))
        return write_file(plain.container, document, buffers, again, came)


@dataclass(frozen=True)
class Model:
    """A document with everything needed to read and write it.

    Attributes:
        container: the GLB it is in, or None.
        document: without compressed geometry.
        compressed: how the file has it, if it is compressed with Draco.
        expanded: how the file has it, if some of it is compressed with meshopt.
        miscounted: accessors that declare another count than Draco data hold for them.
    """

    container: Container | None
    document: Document
    accessors: Accessors
    scene: Scene
    limits: Limits
    policy: ReadPolicy
    compressed: Compressed | None = None
    expanded: Expanded | None = None
    miscounted: tuple[Accessor, ...] = ()

    @staticmethod
    def read(
        data: bytes,
        container: Container | None,
        resources: Mapping[str, bytes],
        limits: Limits,
        policy: ReadPolicy,
    ) -> Model:
        """Parse a document and read its scene. Raises as ``read_gltf`` does."""
        document = parse_document(data if container is None else container.json, limits)
        buffers = Buffers(document, container.binary if container else None, resources)
        if expanded := expand(document, buffers, limits):
            document, buffers = expanded.document, expanded.buffers
        compressed = None
        miscounted: tuple[Accessor, ...] = ()
        if inflated := inflate(document, buffers, limits):
            compressed = Compressed(inflated.compressed, buffers, inflated.primitives)
            document, buffers = inflated.plain, inflated.buffers
            miscounted = inflated.miscounted
        model = Model.of(container, document, buffers, limits, policy, compressed)
        return replace(model, expanded=expanded, miscounted=miscounted)

    @staticmethod
    def of(
        container: Container | None,
        document: Document,
        buffers: Buffers,
        limits: Limits,
        policy: ReadPolicy,
        compressed: Compressed | None = None,
    ) -> Model:
        """Read a document's scene."""
        accessors = Accessors(document, buffers, limits)
        scene = read_scene(document, accessors, limits, policy)
        return Model(container, document, accessors, scene, limits, policy, compressed)

    def rebuilt(self, document: Document, buffers: Buffers) -> Model:
        """The same model with another document and buffers."""
        model = Model.of(
            self.container, document, buffers, self.limits, self.policy, self.compressed
        )
        return replace(model, expanded=self.expanded, miscounted=self.miscounted)

    def store_positions(
        self, editor: BufferEditor, positions: NDArray[np.float64], moved: NDArray[np.bool_]
    ) -> None:
        """Write raw vertices through the inverse of what places them.

        Args:
            editor: takes the changes.
            positions: (r, 3) world positions.
            moved: (r,) which of them to write.
        """
        for block in self.scene.blocks:
            rows = np.flatnonzero(moved[block.rows])
            world = positions[block.rows][rows]
            editor.store(block.accessor, rows, block.pose.restore(world, rows))

    def to_bytes(self, editor: BufferEditor, came: Expanded | None = None) -> bytes:
        """The file, with what an editor has changed; compressed again as it came, if given."""
        return write_file(self.container, self.document, self.accessors.buffers, editor, came)


def write_file(
    container: Container | None,
    document: Document,
    buffers: Buffers,
    editor: BufferEditor,
    came: Expanded | None = None,
) -> bytes:
    """A document with an editor's changes, in the container it came in.

    Args:
        container: that, or None.
        document: without buffer views compressed with meshopt.
        buffers: of it.
        editor: the changes.
        came: how the file had them, if they are compressed again.
    """
    changed = editor.changed_buffers()
    text = editor.new_json(document, changed)
    in_file = (data for index, data in changed.items() if buffers[index].source == "binary")
    binary = next(in_file, buffers.binary)
    if came is not None:
        edited = document.changed(text)
        edited, packed = compress_again(
            edited, buffers.belonging_to(edited, binary), came, editor.accessors.limits
        )
        text, binary = edited.text, packed.binary
    return text.encode() if container is None else join_glb(container, text, binary)
