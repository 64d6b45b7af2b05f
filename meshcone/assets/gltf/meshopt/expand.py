"""Turns compressed buffer views into plain ones: the same document, its bytes there.

Compressed data take the place of nothing: what they stood in is cut out, and what they hold is
appended to the same buffer. A view whose plain copy is there as well keeps that.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

from meshcone.assets.gltf.buffers import Buffers, encode_data_uri
from meshcone.assets.gltf.decoding import Blob, decode
from meshcone.assets.gltf.decoding.child import FILTERS, MESHOPT_HEAD, MODES
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import MESHOPT, extension_of
from meshcone.assets.gltf.json_text import spelled
from meshcone.assets.gltf.splice import JsonChanges, Path, change_json
from meshcone.assets.limits import Limits

_ALIGNMENT = 8  # of what moves: shifts are multiples of it, so that what was aligned stays so
LARGEST_STRIDE = 256
_STRIDES = {"OCTAHEDRAL": (4, 8), "QUATERNION": (8,), "COLOR": (4, 8)}


@dataclass(frozen=True)
class CompressedView:
    """A compressed buffer view.

    Attributes:
        name: of the extension.
        extension: what it says of the view.
        buffer, start, length: where its compressed data are.
        stored: whether its plain bytes are there as well.
    """

    index: int
    element: Element
    name: str
    extension: Element
    buffer: int
    start: int
    length: int
    count: int
    stride: int
    mode: str
    filter: str
    stored: bool

    @property
    def size(self) -> int:
        """Bytes of what it holds."""
        return self.count * self.stride

    def data(self, buffers: Buffers) -> bytes:
        """The stream."""
        return bytes(buffers[self.buffer].data[self.start : self.start + self.length])


@dataclass(frozen=True)
class Expanded:
    """A document and its plain form.

    Attributes:
        original, packed: the document and its buffers as they came.
        document, buffers: the same without compressed views.
        views: those that were compressed.
        decoded: what those held whose plain bytes were nowhere, by index.
    """

    original: Document
    packed: Buffers
    document: Document
    buffers: Buffers
    views: tuple[CompressedView, ...]
    decoded: Mapping[int, bytes]

    @property
    def squeezed(self) -> list[CompressedView]:
        """Views whose plain bytes were nowhere."""
        return [view for view in self.views if view.index in self.decoded]


def expand(document: Document, buffers: Buffers, limits: Limits) -> Expanded | None:
    """Decompress every buffer view.

    Returns:
        None if nothing is compressed.

    Raises:
        InputError: the data are damaged, or not what is declared.
        LimitError: there is more of them than ``limits`` accept.
    """
    views = _compressed(document, buffers)
    if not views:
        return None
    missing = [view for view in views if not view.stored]
    size = sum(view.size for view in missing)
    limits.check("file_bytes", size, "bytes when decompressed", "/bufferViews")
    blobs = [
        Blob(_head(view) + view.data(buffers), view.size, view.element.pointer) for view in missing
    ]
    decoded = {}
    for view, arrays in zip(missing, decode("meshopt", blobs), strict=True):
        decoded[view.index] = arrays["rows"].tobytes()
    plain = _Rewriting(document, buffers, views, decoded).finish()
    return Expanded(document, buffers, *plain, tuple(views), decoded)


def _compressed(document: Document, buffers: Buffers) -> list[CompressedView]:
    found = []
    for index, element in enumerate(document.root.children("bufferViews")):
        for name in MESHOPT:
            extension = extension_of(element, name)
            if extension is not None:
                found.append(_read(index, element, name, extension, buffers))
                break
    return found


def _read(
    index: int, element: Element, name: str, extension: Element, buffers: Buffers
) -> CompressedView:
    own = element.reference("buffer", len(buffers), "buffer")
    buffer = extension.reference("buffer", len(buffers), "buffer")
    if own is None or buffer is None:
        holder = element if own is None else extension
        raise holder.error("buffer", "'buffer' is missing")
    view = CompressedView(
        index=index,
        element=element,
        name=name,
        extension=extension,
        buffer=buffer,
        start=extension.integer("byteOffset") or 0,
        length=extension.required_integer("byteLength", minimum=1),
        count=extension.required_integer("count", minimum=1),
        stride=extension.required_integer("byteStride", minimum=1),
        mode=extension.text("mode") or "",
        filter=extension.text("filter") or "NONE",
        stored=buffers.is_stored(own),
    )
    available = buffers[buffer].length
    if view.start + view.length > available:
        end = view.start + view.length
        raise extension.error("byteLength", f"ends at byte {end:,} of a buffer of {available:,}")
    _check_kind(view, extension)
    length = element.required_integer("byteLength", minimum=1)
    if view.size != length:
        raise extension.error(
            "count",
            f"{view.count:,} elements of {view.stride} bytes are {view.size:,} bytes, the view "
            f"declares {length:,}",
        )
    return view


def _check_kind(view: CompressedView, extension: Element) -> None:
    if view.mode not in MODES:
        expected = ", ".join(MODES)
        raise extension.error("mode", f"expected one of {expected}, found '{view.mode[:20]}'")
    if view.filter not in FILTERS:
        expected = ", ".join(FILTERS)
        raise extension.error("filter", f"expected one of {expected}, found '{view.filter[:20]}'")
    if view.mode != "ATTRIBUTES":
        if view.filter != "NONE":
            raise extension.error("filter", f"'{view.filter}' is for ATTRIBUTES only")
        if view.stride not in (2, 4):
            raise extension.error("byteStride", f"indices have 2 or 4 bytes, found {view.stride}")
        if view.mode == "TRIANGLES" and view.count % 3:
            raise extension.error("count", f"{view.count} indices do not make whole triangles")
    elif view.stride % 4 or view.stride > LARGEST_STRIDE:
        raise extension.error(
            "byteStride",
            f"expected a multiple of 4 up to {LARGEST_STRIDE}, found {view.stride}",
        )
    elif view.stride not in _STRIDES.get(view.filter, (view.stride,)):
        raise extension.error("byteStride", f"'{view.filter}' has no elements of {view.stride}")


def _head(view: CompressedView) -> bytes:
    mode, kind = MODES.index(view.mode), FILTERS.index(view.filter)
    return MESHOPT_HEAD.pack(view.count, view.stride, mode, kind)


class _Rewriting:
    """Writes a document whose compressed views are plain.

    Args:
        document: as it came.
        buffers: its buffers.
        views: those that are compressed.
        decoded: what those hold whose plain bytes are nowhere, by index.
    """

    def __init__(
        self,
        document: Document,
        buffers: Buffers,
        views: list[CompressedView],
        decoded: Mapping[int, bytes],
    ) -> None:
        self._document = document
        self._buffers = buffers
        self._views = views
        self._decoded = decoded
        self._elements = document.root.children("bufferViews")
        self._new_views = [dict(element.value) for element in self._elements]
        self._new_buffers = [dict(each.value) for each in document.root.children("buffers")]

    def finish(self) -> tuple[Document, Buffers]:
        """The document and its buffers."""
        binary = None
        for index in sorted({view.buffer for view in self._views}):
            data = self._rebuilt(index)
            self._new_buffers[index]["byteLength"] = len(data)
            data = self._buffers.rebuilt(index, data)
            if self._buffers[index].source == "binary":
                binary = data
            else:
                uri = self._new_buffers[index].get("uri")
                self._new_buffers[index]["uri"] = encode_data_uri(data, uri)
        for view in self._views:
            _drop_extension(self._new_views[view.index])
        self._drop_fallbacks()
        changes = JsonChanges()
        changes.replaced["buffers",] = spelled(self._new_buffers)
        for number, value in enumerate(self._new_views):
            if value != self._elements[number].value:
                changes.replaced["bufferViews", number] = spelled(value)
        for key in ("extensionsUsed", "extensionsRequired"):
            _drop_names(self._document, key, changes)
        document = self._document.changed(change_json(self._document.text, changes))
        return document, self._buffers.belonging_to(document, binary)

    def _rebuilt(self, buffer: int) -> bytes:
        """A buffer without what was compressed in it and with what that holds."""
        old = self._buffers[buffer].data[: self._buffers[buffer].length]
        cuts = self._cuts(buffer)
        parts, reached = [], 0
        for start, end in cuts:
            parts.append(old[reached:start])
            reached = end
        parts.append(old[reached:])
        self._shift(buffer, cuts)
        length = sum(map(len, parts))
        for view in self._views:
            if view.buffer != buffer or view.index not in self._decoded:
                continue
            padding = -length % _ALIGNMENT
            data = self._decoded[view.index]
            parts += [bytes(padding), data]
            self._new_views[view.index]["buffer"] = buffer
            self._new_views[view.index]["byteOffset"] = length + padding
            length += padding + len(data)
        return b"".join(parts)

    def _cuts(self, buffer: int) -> list[tuple[int, int]]:
        """Compressed bytes that no plain view reads, in whole steps of the alignment."""
        kept = sorted(self._plain(buffer))
        starts = [start for start, _ in kept]
        reached = list(accumulate((end for _, end in kept), max))
        cuts: list[tuple[int, int]] = []
        for view in sorted(self._views, key=lambda each: each.start):
            if view.buffer != buffer:
                continue
            start = max(view.start, cuts[-1][1] if cuts else 0)
            end = start + (view.start + view.length - start) // _ALIGNMENT * _ALIGNMENT
            before = bisect_right(starts, end - 1) - 1
            if end > start and (before < 0 or reached[before] <= start):
                cuts.append((start, end))
        return cuts

    def _plain(self, buffer: int) -> list[tuple[int, int]]:
        compressed = {view.index for view in self._views if not view.stored}
        found = []
        for index, element in enumerate(self._elements):
            if index not in compressed and element.integer("buffer") == buffer:
                start = element.integer("byteOffset") or 0
                found.append((start, start + (element.integer("byteLength") or 0)))
        return found

    def _shift(self, buffer: int, cuts: list[tuple[int, int]]) -> None:
        ends = [end for _, end in cuts]
        removed = [0, *accumulate(end - start for start, end in cuts)]
        for index, element in enumerate(self._elements):
            start = element.integer("byteOffset") or 0
            shift = removed[bisect_right(ends, start)]
            stays = index not in self._decoded and element.integer("buffer") == buffer
            if shift and stays:
                self._new_views[index]["byteOffset"] = start - shift

    def _drop_fallbacks(self) -> None:
        """Buffers at the end that were only there to be decompressed into."""
        used = {value.get("buffer") for value in self._new_views}
        while self._new_buffers and len(self._new_buffers) - 1 not in used:
            if self._buffers.is_stored(len(self._new_buffers) - 1):
                break
            self._new_buffers.pop()
        for index, value in enumerate(self._new_buffers):
            if not self._buffers.is_stored(index):
                _drop_extension(value)


def _drop_extension(value: dict[str, Any]) -> None:
    extensions = {
        name: each for name, each in value.get("extensions", {}).items() if name not in MESHOPT
    }
    if extensions:
        value["extensions"] = extensions
    else:
        value.pop("extensions", None)


def _drop_names(document: Document, key: str, changes: JsonChanges) -> None:
    names = document.root.texts(key)
    kept = [name for name in names if name not in MESHOPT]
    path: Path = (key,)
    if len(kept) == len(names):
        return
    if kept:
        changes.replaced[path] = spelled(kept)
    else:
        changes.removed.add(path)
