"""Compresses again what came compressed, with the vertices where they are now.

The document goes back to the form it was read in; each bitstream that changed takes the place
of the old one. Positions that are floats are rounded to a grid of 2^16 steps along the longest
side of the mesh's bounding box, one grid for all primitives of a mesh, so that no seam between
them opens. Everything else a bitstream holds is stored exactly, and vertices and triangles stay
in their order, because uncompressed attributes and morph targets count on it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import DracoPy
import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors, bounds
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draco.primitives import DracoPrimitive
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.extensions import DRACO
from meshcone.assets.gltf.write import BufferEditor
from meshcone.assets.limits import Limits

POSITION_BITS = 16
_POSITION = 0  # attribute type in a bitstream
_FLOAT = 5126
_LEVEL = 7  # of compression, of 10: beyond it takes long and gains little
_STORABLE = {"float32", "uint8", "uint16", "uint32"}


def check_encodable(primitives: Iterable[DracoPrimitive]) -> None:
    """Check that ``deflate`` can write what primitives hold.

    Primitives may share a bitstream, if they take the same of it.

    Raises:
        InputError: an attribute besides the positions has signed integers, or a bitstream is
            shared by primitives of several meshes or with other attributes.
    """
    uses: dict[int, tuple[int, dict[str, int]]] = {}
    for primitive in primitives:
        accessors = {name: accessor.index for name, (accessor, _) in primitive.attributes.items()}
        use = (primitive.mesh, accessors)
        if uses.setdefault(primitive.view, use) != use:
            raise primitive.element.error(
                "extensions", "shares its Draco data in a way that cannot be compressed again"
            )
        for name, (accessor, _) in primitive.attributes.items():
            component = accessor.component.name
            if component not in _STORABLE and name != "POSITION":
                raise accessor.element.error(
                    "componentType",
                    f"{name[:40]} of type {component} cannot be compressed again; set draco=plain",
                )


def deflate(
    document: Document,
    buffers: Buffers,
    primitives: list[DracoPrimitive],
    editor: BufferEditor,
    limits: Limits,
) -> tuple[Document, Buffers]:
    """Put changed geometry back into the document it was decompressed from.

    Args:
        document: as it was read, compressed.
        buffers: its buffers.
        primitives: what of it is compressed.
        editor: the changes to its decompressed form, whose accessors have the same indices.
        limits: those it was read under.

    Returns:
        The document with new bitstreams; what is not compressed is not changed in it yet.
    """
    draft = Draft(document, buffers, limits)
    of_mesh: dict[int, list[DracoPrimitive]] = defaultdict(list)
    for primitive in primitives:
        of_mesh[primitive.mesh].append(primitive)
    written: dict[int, dict[str, int]] = {}
    for mesh in of_mesh.values():
        if not any(editor.touches(accessor.index) for p in mesh for accessor in _stored(p)):
            continue
        grid = _Grid.around([editor.read(_plain(editor, p, "POSITION")) for p in mesh])
        for primitive in mesh:
            if primitive.view not in written:
                written[primitive.view] = _encode(draft, editor, primitive, grid)
            ids = {name: written[primitive.view][name] for name in primitive.attributes}
            path = ("meshes", primitive.mesh, "primitives", primitive.number, "extensions", DRACO)
            draft.put((*path, "attributes"), ids)
    return draft.finish()


def bitstream_accessors(primitives: Iterable[DracoPrimitive]) -> set[int]:
    """Accessors that are stored in bitstreams and nowhere else."""
    return {a.index for p in primitives for a in (p.indices, *_stored(p)) if a.dense is None}


class _Grid:
    """Where positions are rounded to."""

    def __init__(self, origin: NDArray[np.float64], side: float) -> None:
        self.origin = origin
        self.side = side

    @staticmethod
    def around(positions: list[NDArray[Any]]) -> _Grid:
        ends = [bounds(each) for each in positions]
        low = np.min([end["min"] for end in ends], axis=0)
        high = np.max([end["max"] for end in ends], axis=0)
        return _Grid(low, float(max((high - low).max(), np.finfo(np.float32).tiny)))


def _stored(primitive: DracoPrimitive) -> list[Accessor]:
    return [accessor for accessor, _ in primitive.attributes.values()]


def _plain(editor: BufferEditor, primitive: DracoPrimitive, name: str) -> Accessor:
    return editor.accessors.describe(primitive.attributes[name][0].index)


def _encode(
    draft: Draft, editor: BufferEditor, primitive: DracoPrimitive, grid: _Grid
) -> dict[str, int]:
    """Replace a primitive's bitstream; returns the unique id of each attribute."""
    values = {name: editor.read(_plain(editor, primitive, name)) for name in primitive.attributes}
    others = {name: number for number, name in enumerate(values) if name != "POSITION"}
    indices = editor.read(editor.accessors.describe(primitive.indices.index))
    positions = values["POSITION"]
    data = DracoPy.encode(
        # Integers are stored as they are: what is quantised already is not rounded again.
        positions if positions.dtype.kind == "f" else positions.astype(np.int32),
        indices.reshape(-1, 3).astype(np.uint32),
        quantization_bits=POSITION_BITS,
        compression_level=_LEVEL,
        quantization_range=grid.side,
        quantization_origin=grid.origin,
        preserve_order=True,
        generic_attributes={number: values[name] for name, number in others.items()} or None,
    )
    decoded = DracoPy.decode(data)  # our own bytes: nothing to fear of them
    stored = next(a for a in decoded.attributes if a["attribute_type"] == _POSITION)
    accessor = primitive.attributes["POSITION"][0]
    if positions.dtype != accessor.component:  # integers that were given room
        draft.put(("accessors", accessor.index, "componentType"), _FLOAT)
        draft.put(("accessors", accessor.index, "normalized"), False)
    _put_bounds(draft, accessor, stored["data"].astype(positions.dtype))
    for _, declared in primitive.filled():
        count = editor.accessors.describe(declared.index).count
        if count != declared.count:
            draft.put(("accessors", declared.index, "count"), count)
    draft.replace(primitive.view, data)
    return {name: others.get(name, stored["unique_id"]) for name in values}


def _put_bounds(draft: Draft, accessor: Accessor, values: NDArray[Any]) -> None:
    for key, bound in (("min", np.min), ("max", np.max)):
        if key in accessor.element.value:
            draft.put(("accessors", accessor.index, key), bound(values, axis=0).tolist())


def replay(editor: BufferEditor, accessors: Accessors, skipped: set[int]) -> BufferEditor:
    """The changes of one editor, made to another form of the same document."""
    again = BufferEditor(accessors)
    for accessor, rows, values in editor.writes:
        if accessor.index not in skipped:
            again.store(accessors.describe(accessor.index), rows, values)
    return again
