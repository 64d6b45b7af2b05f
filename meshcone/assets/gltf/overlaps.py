"""Which bytes of a document's buffers something reads that is not written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Set

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessors, Region
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.uses import views_of_extensions
from meshcone.errors import InputError

# Accessors may declare the same bytes any number of times; this bounds the time to compare them.
_COMPARED_BYTES_PER_BYTE = 64


class Marks:
    """Marked bytes of some buffers.

    What was compared is known from then on: exporters declare one run of vertices for each of
    hundreds of primitives.

    Args:
        buffers: of the document.
        indices: the buffers that bytes are marked in; others are passed over.
    """

    def __init__(self, buffers: Buffers, indices: Iterable[int]) -> None:
        self._marked = {each: np.zeros(buffers[each].length, dtype=bool) for each in set(indices)}
        self._added: set[Region] = set()
        self._clear: set[Region] = set()  # of which no byte is marked
        self._budget = _COMPARED_BYTES_PER_BYTE * sum(map(len, self._marked.values()))

    def add(self, regions: Iterable[Region]) -> None:
        """Mark all bytes of some regions."""
        new = [region for region in regions if region not in self._added]
        if new:
            self._added.update(new)
            self._clear.clear()
        for elements in self._elements(new):
            elements[:] = True

    def touch(self, regions: Iterable[Region]) -> bool:
        """Whether a byte of some regions is marked.

        Raises:
            InputError: more bytes were compared than a file can ask for in earnest.
        """
        return any(map(self._touches, regions))

    def _touches(self, region: Region) -> bool:
        if region in self._added:
            return region.buffer in self._marked
        if region in self._clear:
            return False
        touched = any(bool(elements.any()) for elements in self._elements([region]))
        if not touched:
            self._clear.add(region)
        return touched

    def _elements(self, regions: Iterable[Region]) -> Iterator[NDArray[np.bool_]]:
        for region in regions:
            if region.buffer in self._marked:
                self._budget -= region.count * region.size
                if self._budget < 0:
                    raise InputError("too many accessors cover the same bytes", place="/accessors")
                yield region.elements(self._marked[region.buffer], np.dtype(bool))


def unreadable(document: Document, accessors: Accessors) -> frozenset[str]:
    """Pointers to what reaches past its buffer, or is malformed: accessors, images, buffer views.

    No viewer can read them. They are found before anything is appended to a buffer: what is
    appended can lie where they reach.
    """
    found = set()
    for index, element in enumerate(accessors.elements):
        try:
            accessors.describe(index)
        except InputError:
            found.add(element.pointer)
    for image in document.root.children("images"):
        try:
            view = image.reference("bufferView", len(accessors.views), "buffer view")
            if view is not None:
                accessors.view_extent(view)
        except InputError:
            found.add(image.pointer)
    for view in _read_by_extensions(document, accessors):
        try:
            accessors.view_extent(view)
        except InputError:
            found.add(accessors.views[view].pointer)
    return frozenset(found)


def bystanders(
    document: Document, accessors: Accessors, written: Set[int], ignored: Set[str]
) -> Iterator[tuple[str, list[Region]]]:
    """What reads bytes besides accessors that are written, whether or not anything uses it.

    Args:
        document: the document.
        accessors: its accessors.
        written: accessors that are written; of these, the numbers of the rows stored apart.
        ignored: pointers to what nothing can read.

    Yields:
        Its pointer, and the bytes that it reads.
    """
    for index, element in enumerate(accessors.elements):
        if index in written:
            sparse = accessors.describe(index).sparse
            if sparse is not None:
                yield element.pointer, [sparse.indices]
        elif element.pointer not in ignored:
            yield element.pointer, accessors.describe(index).regions
    for image in document.root.children("images"):
        if image.pointer in ignored:
            continue
        view = image.reference("bufferView", len(accessors.views), "buffer view")
        if view is not None:
            start, length, buffer = accessors.view_extent(view)
            yield image.pointer, [Region(buffer, start, length, 1, 1)]
    for number in _read_by_extensions(document, accessors):
        pointer = accessors.views[number].pointer
        if pointer not in ignored:
            start, length, buffer = accessors.view_extent(number)
            yield pointer, [Region(buffer, start, length, 1, 1)]


def _read_by_extensions(document: Document, accessors: Accessors) -> list[int]:
    """Buffer views that extensions of the document name, such as tables of properties."""
    named = views_of_extensions(document.root)
    return sorted({view for view in named if 0 <= view < len(accessors.views)})
