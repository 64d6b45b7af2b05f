"""A document about to be given further objects, or bytes in place of others."""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Any

from meshcone.assets.gltf.buffers import Buffers, encode_data_uri
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.json_text import spelled
from meshcone.assets.gltf.splice import JsonChanges, Path, change_json
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

# Offsets shift by multiples of this, so that whatever was aligned stays aligned.
_ALIGNMENT = 8


@dataclass(frozen=True)
class _Piece:
    """Bytes from ``start`` to ``end`` of a buffer that others take the place of."""

    start: int
    end: int
    data: bytes

    @property
    def growth(self) -> int:
        return len(self.data) - (self.end - self.start)


class Draft:
    """Collects changes to a document's structure and its buffers.

    Indices of existing objects do not change: objects are appended, their members set or
    removed, and what a buffer view holds replaced. ``finish`` makes all of it at once.
    """

    def __init__(self, document: Document, buffers: Buffers, limits: Limits) -> None:
        self._document = document
        self._buffers = buffers
        self._limits = limits
        self._json_bytes = len(document.text)
        self._members: dict[Path, object] = {}
        self._removed: set[Path] = set()
        self._extended: dict[Path, list[dict[str, Any]]] = defaultdict(list)
        self._entries: dict[str, list[dict[str, Any]]] = defaultdict(list)
        self._replaced: dict[int, list[_Piece]] = defaultdict(list)
        self._appended: dict[int, list[tuple[int, bytes]]] = defaultdict(list)
        self._padding: dict[int, int] = {}
        self._overrun: dict[int, bool] = {}
        self._further: int | None = None

    def put(self, path: Path, value: object) -> None:
        """Set a member of an existing object, or an entry of an existing array."""
        self._members[path] = value

    def remove(self, path: Path) -> None:
        """Remove an existing member of an object."""
        self._removed.add(path)

    def extend(self, path: Path, value: dict[str, Any]) -> None:
        """Append an object to an existing array that is not one of the root.

        Raises:
            LimitError: the document grows larger than one may be that is sent.
        """
        self._grow(value)
        self._extended[path].append(value)

    def append(self, array: str, value: dict[str, Any]) -> int:
        """Append an object, which may still change, to an array of the root; returns its index.

        Raises:
            LimitError: the document grows larger than one may be that is sent.
        """
        self._grow(value)
        self._entries[array].append(value)
        return len(self._document.root.children(array)) + len(self._entries[array]) - 1

    def _grow(self, value: dict[str, Any]) -> None:
        self._json_bytes += len(spelled(value))
        self._limits.check("json_bytes", self._json_bytes, "bytes of JSON after copying")

    def store(self, buffer: int, data: bytes, members: dict[str, Any]) -> int:
        """Append bytes to a buffer, as a new buffer view.

        A buffer that some view reaches past stays as long as it is: what is broken must not
        begin to read what is appended. A new buffer takes the bytes then.

        Args:
            buffer: the buffer.
            data: not empty.
            members: further members of the view, such as ``target``.
        """
        if self._is_overrun(buffer):
            buffer = self._new_buffer()
        view = {"buffer": buffer, "byteOffset": 0, "byteLength": len(data)} | members
        index = self.append("bufferViews", view)
        self._appended[buffer].append((index, data))
        return index

    def replace(self, view: int, data: bytes) -> None:
        """Put other bytes in the place of those a buffer view holds.

        Where another view reads some of them they stay, and the new ones are appended as those of
        a new view are.
        """
        buffer, start, end = _extent(self._views[view])
        self.put(("bufferViews", view, "byteLength"), len(data))
        if view in self._alone:
            self._padding[view] = -start % _ALIGNMENT
            data = bytes(self._padding[view]) + data
            growth = len(data) - (end - start)
            self._replaced[buffer].append(_Piece(start, end, data + bytes(-growth % _ALIGNMENT)))
        else:
            if self._is_overrun(buffer):
                buffer = self._new_buffer()
                self.put(("bufferViews", view, "buffer"), buffer)
            self._appended[buffer].append((view, data))

    def finish(self) -> tuple[Document, Buffers]:
        """The document and its buffers with all the changes."""
        binary = None
        for index in sorted({*self._replaced, *self._appended}):
            data = self._rebuilt(index)
            if index >= len(self._buffers):
                entry = self._entries["buffers"][index - len(self._buffers)]
                entry.update(byteLength=len(data), uri=encode_data_uri(data, None))
                continue
            self.put(("buffers", index, "byteLength"), len(data))
            data = self._buffers.rebuilt(index, data)
            if self._buffers[index].source == "binary":
                binary = data
            else:
                uri = self._document.root.children("buffers")[index].text("uri")
                self.put(("buffers", index, "uri"), encode_data_uri(data, uri))
        document = self._document.changed(change_json(self._document.text, self._json_changes()))
        return document, self._buffers.belonging_to(document, binary)

    def _is_overrun(self, buffer: int) -> bool:
        if buffer not in self._overrun:
            length = self._buffers[buffer].length
            self._overrun[buffer] = any(
                view.value.get("buffer") == buffer and _end(view) > length for view in self._views
            )
        return self._overrun[buffer]

    def _new_buffer(self) -> int:
        if self._further is None:
            self._further = self.append("buffers", {"byteLength": 0, "uri": ""})
        return self._further

    def _json_changes(self) -> JsonChanges:
        changes = JsonChanges(removed=self._removed)
        for path, value in self._members.items():
            holder: Any = self._document.root.value
            for key in path[:-1]:
                holder = holder[key]
            if isinstance(holder, list) or path[-1] in holder:
                changes.replaced[path] = spelled(value)
            else:
                changes.added[path[:-1]].append(f"{spelled(path[-1])}: {spelled(value)}")
        for path, values in self._extended.items():
            changes.added[path] += map(spelled, values)
        for array, entries in self._entries.items():
            if array in self._document.root.value:
                changes.added[(array,)] += map(spelled, entries)
            else:
                changes.added[()].append(f"{spelled(array)}: {spelled(entries)}")
        return changes

    @cached_property
    def _views(self) -> list[Element]:
        return self._document.root.children("bufferViews")

    @cached_property
    def _alone(self) -> set[int]:
        """Views that share no byte with another."""
        if any("extensions" in view.value for view in self._views):
            return set()  # an extension may count bytes of its own
        extents = sorted((*_extent(view), index) for index, view in enumerate(self._views))
        alone = set()
        last_buffer, reached = -1, 0
        for place, (buffer, start, end, index) in enumerate(extents):
            if buffer != last_buffer:
                last_buffer, reached = buffer, 0
            following = extents[place + 1] if place + 1 < len(extents) else (-1, 0, 0, 0)
            if start >= reached and not (following[0] == buffer and following[1] < end):
                alone.add(index)
            reached = max(reached, end)
        return alone

    def _rebuilt(self, buffer: int) -> bytes:
        old = memoryview(b"")
        if buffer < len(self._buffers):
            old = memoryview(self._buffers[buffer].data)[: self._buffers[buffer].length]
        pieces = sorted(self._replaced[buffer], key=lambda piece: piece.start)
        parts: list[bytes | memoryview] = []
        copied = 0
        for piece in pieces:
            parts += [old[copied : piece.start], piece.data]
            copied = piece.end
        parts.append(old[copied:])
        if pieces:
            self._shift_views(buffer, pieces)
        length = sum(map(len, parts))
        for view, data in self._appended[buffer]:
            padding = -length % _ALIGNMENT
            parts += [bytes(padding), data]
            self._place(view, length + padding)
            length += padding + len(data)
        return b"".join(parts)

    def _shift_views(self, buffer: int, pieces: list[_Piece]) -> None:
        ends = [piece.end for piece in pieces]
        shifts = [0, *accumulate(piece.growth for piece in pieces)]
        for index, view in enumerate(self._views):
            of_buffer, start, _ = _extent(view)
            shift = shifts[bisect_right(ends, start)] + self._padding.get(index, 0)
            if shift and of_buffer == buffer:
                self._place(index, start + shift)

    def _place(self, view: int, offset: int) -> None:
        if view < len(self._views):
            self.put(("bufferViews", view, "byteOffset"), offset)
        else:
            self._entries["bufferViews"][view - len(self._views)]["byteOffset"] = offset


def _end(view: Element) -> int:
    """Where a view that may be malformed ends; 0 if that cannot be told."""
    try:
        return _extent(view)[2]
    except InputError:
        return 0


def _extent(view: Element) -> tuple[int, int, int]:
    """Buffer, start and end of a view that nobody has checked."""
    start = view.integer("byteOffset") or 0
    buffer = view.required_integer("buffer")
    return buffer, start, start + view.required_integer("byteLength", minimum=1)
