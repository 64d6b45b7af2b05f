"""Puts longer tables in the place of those that accessors read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors, bounds
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.uses import accessor_uses, uses_of_primitive, views_of_extensions

_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963
_STRIDE_ALIGNMENT = 4  # of vertex attributes (section 3.6.2.4)
_TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_INDEX_TYPES = ("<u1", "<u2", "<u4")
# Members of an accessor that say where its elements are, or of which type.
_PLACE = ("bufferView", "byteOffset", "sparse", "componentType", "normalized", "count")


class Tables:
    """The accessors of some primitives, each about to read more elements.

    An accessor that nothing else reads keeps its index, and a buffer view that no other reads
    is replaced, so that nothing is left in the file that nobody needs. For the same reason one
    that is sparse stays so: what it stores apart are old elements, whose numbers do not change.

    Args:
        draft: takes the changes.
        document: the document.
        accessors: its accessors.
        primitives: all those whose accessors are replaced.
    """

    def __init__(
        self, draft: Draft, document: Document, accessors: Accessors, primitives: list[Element]
    ) -> None:
        self._draft, self._accessors = draft, accessors
        count = len(accessors.elements)
        replaced = Counter(
            use.accessor for each in primitives for use in uses_of_primitive(each, count)
        )
        uses = Counter(use.accessor for use in accessor_uses(document.root, count))
        self._free = {index for index in replaced if replaced[index] == uses[index]}
        views = Counter(_all_views(document, accessors))
        left = Counter(view for index in self._free for view in _views(accessors.elements[index]))
        self._free_views = {view for view in left if left[view] == views[view]}

    def vertices(self, accessor: Accessor, stored: NDArray[Any]) -> int:
        """Store an attribute of vertices; return the accessor that reads it from now on.

        Args:
            accessor: the one that it was read by.
            stored: (n, columns) components, in the old type or as floats.
        """
        size = stored.dtype.itemsize
        padding = -size * stored.shape[1] % _STRIDE_ALIGNMENT
        padded = np.pad(stored, ((0, 0), (0, padding // size))) if padding else stored
        members: dict[str, Any] = {"target": _ARRAY_BUFFER}
        if padding:
            members["byteStride"] = size * padded.shape[1]
        return self._store(accessor, stored, padded.tobytes(), members)

    def indices(self, primitive: Element, values: NDArray[np.int64]) -> int:
        """Store (k,) indices in a type that holds them; return the accessor that reads them.

        The type is never narrower than it was, and the largest of its numbers, which restarts
        a primitive, stays unused (section 3.7.2.1).
        """
        index = primitive.reference("indices", len(self._accessors.elements), "accessor")
        top = int(values.max(initial=0))
        fitting = [np.dtype(each) for each in _INDEX_TYPES]
        fitting = [each for each in fitting if top < np.iinfo(each).max]
        members: dict[str, Any] = {"target": _ELEMENT_ARRAY_BUFFER}
        if index is None:
            stored = values.astype(fitting[0])
            view = self._draft.store(0, stored.tobytes(), members)
            declared = {"bufferView": view, "type": "SCALAR", **_declared(stored[:, None])}
            return self._draft.append("accessors", declared)
        accessor = self._accessors.describe(index)
        wide = max(fitting[0], accessor.component, key=lambda each: each.itemsize)
        stored = values.astype(wide)[:, None]
        return self._store(accessor, stored, stored.tobytes(), members)

    def _store(
        self, accessor: Accessor, stored: NDArray[Any], data: bytes, members: dict[str, Any]
    ) -> int:
        element = accessor.element.value
        buffer = accessor.regions[0].buffer if accessor.regions else 0
        declared = _declared(stored)
        if accessor.normalized and stored.dtype.kind != "f":
            declared["normalized"] = True
        declared |= {key: value for key, value in bounds(stored).items() if key in element}
        if accessor.index not in self._free:
            kept = {key: value for key, value in element.items() if key not in _PLACE}
            view = self._draft.store(buffer, data, members)
            return self._draft.append("accessors", kept | declared | {"bufferView": view})
        self._free.discard(accessor.index)
        declared["bufferView"] = self._view(accessor, buffer, data, members)
        path = ("accessors", accessor.index)
        for key, value in declared.items():
            self._draft.put((*path, key), value)
        staying = {"sparse"} if self._stays_sparse(accessor, stored) else set()
        for key in _PLACE:
            if key in element and key not in declared and key not in staying:
                self._draft.remove((*path, key))
        return accessor.index

    def _stays_sparse(self, accessor: Accessor, stored: NDArray[Any]) -> bool:
        """Whether what an accessor stores apart is right, or made so, beside a longer table."""
        if accessor.sparse is None:
            return False
        apart = stored[self._accessors.sparse_rows(accessor)]
        values, indices = _sparse_views(accessor.element)
        if accessor.element.integer("bufferView") in (values, indices):
            return False
        if stored.dtype == accessor.component:
            return np.array_equal(apart, self._accessors.sparse_values(accessor))
        if values == indices or values not in self._free_views:
            return False
        self._free_views.discard(values)
        self._draft.replace(values, apart.tobytes())
        if accessor.element.value["sparse"]["values"].get("byteOffset"):
            self._draft.put(("accessors", accessor.index, "sparse", "values", "byteOffset"), 0)
        return True

    def _view(self, accessor: Accessor, buffer: int, data: bytes, members: dict[str, Any]) -> int:
        """A view for data: that of the elements, if nothing else needs it, or a new one."""
        view = accessor.element.integer("bufferView")
        if view is None or view not in self._free_views:
            return self._draft.store(buffer, data, members)
        self._free_views.discard(view)
        self._draft.replace(view, data)
        path, value = ("bufferViews", view), self._accessors.views[view].value
        if "byteStride" in members:
            self._draft.put((*path, "byteStride"), members["byteStride"])
        elif "byteStride" in value:
            self._draft.remove((*path, "byteStride"))
        if "target" in value:
            self._draft.put((*path, "target"), members["target"])
        return view


def _declared(stored: NDArray[Any]) -> dict[str, Any]:
    return {"componentType": _TYPES[stored.dtype.str[1:]], "count": len(stored)}


def _views(accessor: Element) -> list[int]:
    """The buffer views that an accessor reads."""
    found = [accessor.integer("bufferView"), *_sparse_views(accessor)]
    return [view for view in found if view is not None]


def _sparse_views(accessor: Element) -> tuple[int | None, int | None]:
    """The buffer views of the values and of the indices of what an accessor stores apart."""
    sparse = accessor.child("sparse")
    parts = [sparse and sparse.child(key) for key in ("values", "indices")]
    values, indices = (part.integer("bufferView") if part else None for part in parts)
    return values, indices


def _all_views(document: Document, accessors: Accessors) -> Iterator[int]:
    """Every use of a buffer view, by accessors, images and extensions of the root."""
    for accessor in accessors.elements:
        yield from _views(accessor)
    for image in document.root.children("images"):
        yield from (view for view in [image.integer("bufferView")] if view is not None)
    yield from views_of_extensions(document.root)
