"""Puts moved vertices back into the buffers of a glTF and its new bounds into the JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors, bounds, encode
from meshcone.assets.gltf.buffers import encode_data_uri
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.splice import Path, replace_values
from meshcone.errors import InputError


class BufferEditor:
    """Collects changes to accessors' elements.

    The changes go to copies of the buffers; ``changed_buffers`` and ``new_json`` tell what
    has become of them.

    Attributes:
        accessors: of the document.
        writes: every change so far: accessor, rows and values.
    """

    def __init__(self, accessors: Accessors) -> None:
        self.accessors = accessors
        self.writes: list[tuple[Accessor, NDArray[np.int64], NDArray[np.float64]]] = []
        self._edited: dict[int, bytearray] = {}
        self._touched: dict[int, Accessor] = {}

    def store(
        self, accessor: Accessor, rows: NDArray[np.int64], values: NDArray[np.float64]
    ) -> None:
        """Write elements, each where it is stored: among the sparse values or in the buffer view.

        Args:
            accessor: one whose bytes nothing else uses.
            rows: (k,) elements to change.
            values: (k, columns) their new values.

        Raises:
            InputError: a value is outside what the component type can hold.
        """
        if len(rows) == 0:
            return
        stored = encode(values, accessor.component, accessor.normalized)
        if stored is None:
            raise InputError(
                f"a refined value does not fit {accessor.component.name}; store floats instead",
                place=accessor.element.pointer,
            )
        self._touched[accessor.index] = accessor
        self.writes.append((accessor, rows, values))
        in_dense = np.ones(len(rows), dtype=bool)
        if accessor.sparse is not None:
            sparse_rows = self.accessors.sparse_rows(accessor)
            slots = np.minimum(np.searchsorted(sparse_rows, rows), len(sparse_rows) - 1)
            in_dense = sparse_rows[slots] != rows
            region = accessor.sparse.values
            elements = region.elements(self._buffer(region.buffer), accessor.component)
            elements[slots[~in_dense]] = stored[~in_dense]
        if accessor.dense is not None and in_dense.any():
            region = accessor.dense
            elements = region.elements(self._buffer(region.buffer), accessor.component)
            elements[rows[in_dense]] = stored[in_dense]

    def touches(self, accessor: int) -> bool:
        """Whether some element of an accessor was written."""
        return accessor in self._touched

    def read(self, accessor: Accessor) -> NDArray[Any]:
        """(count, columns) stored components with the changes made so far."""
        return self.accessors.read(accessor, self._edited)

    def changed_buffers(self) -> dict[int, bytes]:
        """Buffers some byte of which is different now."""
        return {
            index: bytes(data)
            for index, data in self._edited.items()
            if data != self.accessors.buffers[index].data
        }

    def new_json(self, document: Document, changed: dict[int, bytes]) -> str:
        """The document with new bounds and with changed buffers that are not the BIN chunk.

        A changed buffer that was a file of its own moves into the document, so that the
        bytes under its name stay those that others may read.
        """
        replacements: dict[Path, str] = {}
        for accessor in self._changed_accessors():
            replacements.update(self._bounds(accessor))
        for index, data in changed.items():
            if self.accessors.buffers[index].source != "binary":
                uri = document.root.children("buffers")[index].text("uri")
                replacements["buffers", index, "uri"] = json.dumps(encode_data_uri(data, uri))
        return replace_values(document.text, replacements)

    def _buffer(self, index: int) -> bytearray:
        if index not in self._edited:
            self._edited[index] = bytearray(self.accessors.buffers[index].data)
        return self._edited[index]

    def _changed_accessors(self) -> Iterator[Accessor]:
        """Those written, and those that say the same of the same bytes, as exporters have them."""
        yield from self._touched.values()
        written = {accessor.content for accessor in self._touched.values()}
        if not written:
            return
        for index, element in enumerate(self.accessors.elements):
            if index in self._touched or not ("min" in element.value or "max" in element.value):
                continue
            with suppress(InputError):  # nothing can read it, and so nothing has been written to it
                accessor = self.accessors.describe(index)
                if accessor.content in written:
                    yield accessor

    def _bounds(self, accessor: Accessor) -> dict[Path, str]:
        """Declared minima and maxima that are no longer true (section 3.6.2.5)."""
        before = self.accessors.read(accessor)
        after = self.read(accessor)
        replacements: dict[Path, str] = {}
        old, new = bounds(before), bounds(after)
        for key in old:
            if key in accessor.element.value and old[key] != new[key]:
                replacements["accessors", accessor.index, key] = json.dumps(new[key])
        return replacements
