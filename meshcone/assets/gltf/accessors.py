"""Typed views into buffers (glTF 2.0, section 3.6.2), checked before anything is allocated."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.element import Element
from meshcone.assets.limits import Limits
from meshcone.assets.number_style import steps_of_floats
from meshcone.errors import InputError

_COMPONENTS: dict[int, np.dtype[Any]] = {
    5120: np.dtype("<i1"),
    5121: np.dtype("<u1"),
    5122: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    5125: np.dtype("<u4"),
    5126: np.dtype("<f4"),
}
_COLUMNS = {
    "SCALAR": (1, 1),
    "VEC2": (1, 2),
    "VEC3": (1, 3),
    "VEC4": (1, 4),
    "MAT2": (2, 2),
    "MAT3": (3, 3),
    "MAT4": (4, 4),
}


@dataclass(frozen=True)
class Region:
    """Evenly spaced elements in one buffer; offsets, sizes and strides in bytes."""

    buffer: int
    offset: int
    count: int
    size: int
    stride: int

    def elements(
        self, data: bytes | bytearray | NDArray[Any], dtype: np.dtype[Any]
    ) -> NDArray[Any]:
        """(count, size / itemsize) view of the elements; writable if the data are."""
        columns = self.size // dtype.itemsize
        return np.ndarray(
            (self.count, columns), dtype, data, self.offset, (self.stride, dtype.itemsize)
        )


@dataclass(frozen=True)
class Sparse:
    """Elements stored apart from the rest (section 3.6.2.3)."""

    indices: Region
    index_type: np.dtype[Any]
    values: Region


@dataclass(frozen=True)
class Accessor:
    """An accessor whose every byte is known to lie within its buffer.

    Attributes:
        dense: where its elements are; None if they are all zero unless ``sparse`` says otherwise.
    """

    index: int
    element: Element
    component: np.dtype[Any]
    kind: str
    count: int
    normalized: bool
    dense: Region | None
    sparse: Sparse | None

    @property
    def columns(self) -> int:
        """Components of an element; those of a matrix column by column, padding included."""
        return _element_size(self.kind, self.component) // self.component.itemsize

    @property
    def step(self) -> float:
        """Distance of the numbers that neighbouring integers stand for; 0 for floats."""
        if self.component.kind == "f":
            return 0.0
        return 1.0 / np.iinfo(self.component).max if self.normalized else 1.0

    @property
    def size(self) -> int:
        """Bytes its elements take, stored densely."""
        return self.count * _element_size(self.kind, self.component)

    @property
    def regions(self) -> list[Region]:
        """All bytes the accessor reads."""
        return self.values + ([self.sparse.indices] if self.sparse else [])

    @property
    def content(self) -> Hashable:
        """Equal for accessors that read the same bytes as the same numbers.

        One that reads none is equal to itself alone.
        """
        place = tuple(self.regions) or self.index
        return self.component.str, self.normalized, place

    @property
    def values(self) -> list[Region]:
        """The bytes of its elements."""
        sparse = [self.sparse.values] if self.sparse else []
        return ([self.dense] if self.dense else []) + sparse


class Accessors:
    """The accessors of one document."""

    def __init__(self, document: Document, buffers: Buffers, limits: Limits) -> None:
        self.elements = document.root.children("accessors")
        self.buffers = buffers
        self.views = document.root.children("bufferViews")
        self.limits = limits

    def describe(self, index: int) -> Accessor:
        """Check an accessor's declaration against its buffer.

        Raises:
            InputError: a declaration is missing, unknown, or reaches past its buffer.
        """
        element = self.elements[index]
        component = _COMPONENTS.get(element.required_integer("componentType"))
        if component is None:
            raise element.error("componentType", "unknown component type")
        kind = element.text("type") or ""
        if kind not in _COLUMNS:
            raise element.error("type", f"unknown accessor type '{kind[:20]}'")
        size = _element_size(kind, component)
        count = element.required_integer("count")
        dense = None
        view = element.reference("bufferView", len(self.views), "buffer view")
        if count and view is not None:
            dense = self.region(element, view, count, size, "count")
        return Accessor(
            index=index,
            element=element,
            component=component,
            kind=kind,
            count=count,
            normalized=element.flag("normalized"),
            dense=dense,
            sparse=self._sparse(element, count, size) if count else None,
        )

    def region(self, element: Element, view: int, count: int, size: int, blame: str) -> Region:
        """Elements at an object's ``byteOffset`` within a buffer view.

        Raises:
            InputError: they reach past the view, or the view past its buffer.
        """
        declared = self.views[view]
        start, length, buffer = self.view_extent(view)
        stride = declared.integer("byteStride") or size
        if stride < size:
            raise declared.error("byteStride", f"{stride} bytes for elements of {size}")
        offset = element.integer("byteOffset") or 0
        needed = offset + stride * (count - 1) + size
        if needed > length:
            raise element.error(
                blame,
                f"{count:,} elements need {needed:,} bytes, buffer view {view} has {length:,}",
            )
        return Region(buffer, start + offset, count, size, stride)

    def view_extent(self, view: int) -> tuple[int, int, int]:
        """Start, length and buffer of a buffer view.

        Raises:
            InputError: it reaches past its buffer.
        """
        element = self.views[view]
        buffer = element.reference("buffer", len(self.buffers), "buffer")
        if buffer is None:
            raise element.error("buffer", "'buffer' is missing")
        start = element.integer("byteOffset") or 0
        length = element.required_integer("byteLength", minimum=1)
        available = self.buffers[buffer].length
        if start + length > available:
            raise element.error(
                "byteLength", f"ends at byte {start + length:,} of a buffer of {available:,}"
            )
        return start, length, buffer

    def view_bytes(self, view: int) -> bytes:
        """What a buffer view holds.

        Raises:
            InputError: it reaches past its buffer.
        """
        start, length, buffer = self.view_extent(view)
        return bytes(self.buffers[buffer].data[start : start + length])

    def read(
        self, accessor: Accessor, edited: Mapping[int, bytearray] | None = None
    ) -> NDArray[Any]:
        """(count, columns) components as stored, sparse elements put in place.

        Args:
            accessor: one that was described.
            edited: buffers to read instead of the file's.
        """
        edited = edited or {}

        def data(region: Region) -> bytes | bytearray:
            return edited.get(region.buffer, self.buffers[region.buffer].data)

        if accessor.dense:
            dense = accessor.dense
            values = dense.elements(data(dense), accessor.component).copy()
        else:
            # No buffer bounds this count.
            place = accessor.element.place("count")
            self.limits.check("vertices", accessor.count, "elements without a buffer", place)
            values = np.zeros((accessor.count, accessor.columns), accessor.component)
        if accessor.sparse:
            stored = accessor.sparse.values
            values[self.sparse_rows(accessor)] = stored.elements(data(stored), accessor.component)
        return values

    def steps(self, accessor: Accessor) -> NDArray[np.float64]:
        """(count,) how far apart the numbers are that an accessor can hold at each element."""
        if accessor.component.kind != "f":
            return np.full(accessor.count, accessor.step)
        return steps_of_floats(self.read(accessor), accessor.component)

    def read_rows(self, accessor: Accessor, rows: NDArray[np.int64]) -> NDArray[Any]:
        """(k, columns) components of some elements as stored; the others are not touched."""
        if accessor.dense:
            data = self.buffers[accessor.dense.buffer].data
            values: NDArray[Any] = accessor.dense.elements(data, accessor.component)[rows]
        else:
            values = np.zeros((len(rows), accessor.columns), accessor.component)
        if accessor.sparse:
            apart = self.sparse_rows(accessor)
            places = np.minimum(np.searchsorted(apart, rows), len(apart) - 1)
            known = apart[places] == rows
            values[known] = self.sparse_values(accessor)[places[known]]
        return values

    def sparse_values(self, accessor: Accessor) -> NDArray[Any]:
        """(k, columns) components of the elements that a sparse accessor stores apart."""
        if accessor.sparse is None:
            return np.zeros((0, accessor.columns), accessor.component)
        stored = accessor.sparse.values
        return stored.elements(self.buffers[stored.buffer].data, accessor.component)

    def sparse_rows(self, accessor: Accessor) -> NDArray[np.int64]:
        """(k,) rows a sparse accessor stores apart, ascending.

        Raises:
            InputError: they are not strictly ascending or name an element past the last.
        """
        if accessor.sparse is None:
            return np.zeros(0, dtype=np.int64)
        region = accessor.sparse.indices
        found = region.elements(self.buffers[region.buffer].data, accessor.sparse.index_type)
        rows = found[:, 0].astype(np.int64)
        if (np.diff(rows) <= 0).any() or rows[-1] >= accessor.count:
            raise accessor.element.error(
                "sparse", f"indices must ascend and stay below {accessor.count}"
            )
        return rows

    def _sparse(self, element: Element, count: int, size: int) -> Sparse | None:
        sparse = element.child("sparse")
        if sparse is None:
            return None
        stored = sparse.required_integer("count", minimum=1)
        if stored > count:
            raise sparse.error("count", f"{stored} sparse elements of only {count}")
        indices, values = sparse.child("indices"), sparse.child("values")
        if indices is None or values is None:
            raise InputError("a sparse accessor needs indices and values", place=sparse.pointer)
        index_type = _COMPONENTS.get(indices.required_integer("componentType"))
        if index_type is None or index_type.kind != "u":
            raise indices.error("componentType", "indices must be unsigned integers")
        index_view = self._required_view(indices)
        value_view = self._required_view(values)
        return Sparse(
            self.region(indices, index_view, stored, index_type.itemsize, "bufferView"),
            index_type,
            self.region(values, value_view, stored, size, "bufferView"),
        )

    def _required_view(self, element: Element) -> int:
        view = element.reference("bufferView", len(self.views), "buffer view")
        if view is None:
            raise element.error("bufferView", "'bufferView' is missing")
        return view


def _element_size(kind: str, component: np.dtype[Any]) -> int:
    """Bytes of one element; matrix columns start at multiples of four (section 3.6.2.4)."""
    columns, rows = _COLUMNS[kind]
    column = rows * component.itemsize
    return column if columns == 1 else columns * (-(-column // 4) * 4)


def decode(stored: NDArray[Any], normalized: bool) -> NDArray[np.float64]:
    """Stored components as numbers (section 3.6.2.2)."""
    with np.errstate(invalid="ignore"):  # a signalling NaN is a NaN
        values = stored.astype(np.float64)
    if not normalized or stored.dtype.kind == "f":
        return values
    return np.maximum(values / np.iinfo(stored.dtype).max, -1.0)


def bounds(stored: NDArray[Any]) -> dict[str, list[Any]]:
    """Least and greatest of each component, as ``min`` and ``max`` (section 3.6.2.5).

    What is not finite, in vertices that no triangle uses, bounds nothing.
    """
    if stored.dtype.kind == "f":
        stored = np.where(np.isfinite(stored), stored, np.nan)
    found = {"min": np.fmin.reduce(stored, axis=0), "max": np.fmax.reduce(stored, axis=0)}
    return {key: np.nan_to_num(value).tolist() for key, value in found.items()}


def encode(
    values: NDArray[np.float64], component: np.dtype[Any], normalized: bool
) -> NDArray[Any] | None:
    """The nearest components that can be stored; None if one is out of the type's range."""
    if component.kind == "f":
        with np.errstate(over="ignore"):
            stored = values.astype(component)
        return stored if np.isfinite(stored).all() else None
    bounds = np.iinfo(component)
    rounded = np.rint(values * bounds.max if normalized else values)
    if rounded.size and (rounded.min() < bounds.min or rounded.max() > bounds.max):
        return None
    return rounded.astype(component)
