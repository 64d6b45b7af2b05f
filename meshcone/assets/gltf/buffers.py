"""The buffers of a glTF: the BIN chunk, data URIs, and files sent along with it.

Nothing is ever opened: a URI is either data or the name of a resource.
"""

from __future__ import annotations

import base64
import binascii
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal
from urllib.parse import unquote, unquote_to_bytes

from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import MESHOPT, extension_of
from meshcone.assets.pointers import refuse_pointer
from meshcone.relative_names import from_uri, sent_as, sent_beyond

_CHUNK_ALIGNMENT = 4  # of the BIN chunk, which zeros fill up
_BASE64 = re.compile(r"; *base64$", re.I)
_BUFFER_TYPE = "data:application/octet-stream;base64,"


@dataclass(frozen=True)
class NamedFile:
    """What a URI means.

    Attributes:
        name: of the file; empty for a data URI.
        data: its bytes.
        embedded: whether they are in the URI itself.
        media_type: as a data URI declares it.
    """

    name: str
    data: bytes
    embedded: bool
    media_type: str | None = None


@dataclass(frozen=True)
class Buffer:
    """One buffer's bytes and where they come from.

    Attributes:
        data: at least ``length`` bytes.
        length: the declared byteLength.
        source: ``binary`` for the BIN chunk, ``data`` for a data URI, ``resource`` for a file.
    """

    data: bytes
    length: int
    source: Literal["binary", "data", "resource"]


class Buffers:
    """Buffers by index, decoded when first needed."""

    def __init__(
        self,
        document: Document,
        binary: bytes | None,
        resources: Mapping[str, bytes],
    ) -> None:
        self._elements = document.root.children("buffers")
        self._binary = binary
        self._resources = resources
        self._loaded: dict[int, Buffer] = {}

    @property
    def binary(self) -> bytes | None:
        """The BIN chunk, if there is one."""
        return self._binary

    def belonging_to(self, document: Document, binary: bytes | None) -> Buffers:
        """The buffers of a changed document.

        Args:
            document: it; buffers that changed hold their data themselves.
            binary: the new BIN chunk, or None where that has not changed.
        """
        kept = self._binary if binary is None else binary
        return Buffers(document, kept, self._resources)

    def is_stored(self, index: int) -> bool:
        """Whether a buffer has bytes: one that exists to be decompressed into has none."""
        element = self._elements[index]
        for each in MESHOPT:
            extension = extension_of(element, each)
            if extension is not None and extension.flag("fallback") and "uri" not in element.value:
                return False
        uri = element.text("uri")
        if uri is None:
            return index == 0 and self._binary is not None
        return uri[:5].lower() == "data:" or self._sent(uri) is not None

    def _sent(self, uri: str) -> str | None:
        """The name under which the file was sent that a URI means."""
        name = from_uri(uri)
        if name is None:
            return sent_beyond(uri, self._resources)
        plain = uri.removeprefix("./")
        return plain if plain in self._resources else sent_as(name, self._resources)

    def __len__(self) -> int:
        return len(self._elements)

    def __getitem__(self, index: int) -> Buffer:
        """One buffer.

        Raises:
            InputError: it is missing, malformed, or shorter than it declares.
        """
        if index not in self._loaded:
            self._loaded[index] = self._load(index, self._elements[index])
        return self._loaded[index]

    def rebuilt(self, index: int, data: bytes) -> bytes:
        """New bytes of a buffer, with what stands behind those that it declares.

        Nobody here knows what that is, so it stays. A chunk ends at a whole step.
        """
        buffer = self[index]
        beyond = buffer.data[buffer.length :]
        if buffer.source != "binary":
            return data + beyond
        padding = -buffer.length % _CHUNK_ALIGNMENT
        data += bytes(-len(data) % _CHUNK_ALIGNMENT)
        data += beyond if any(beyond[:padding]) else beyond[padding:]
        return data + bytes(-len(data) % _CHUNK_ALIGNMENT)

    def _load(self, index: int, element: Element) -> Buffer:
        length = element.required_integer("byteLength", minimum=1)
        uri = element.text("uri")
        if uri is None:
            if index != 0 or self._binary is None:
                raise element.error("uri", f"buffer {index} has no data")
            buffer = Buffer(self._binary, length, "binary")
        else:
            file = self.named(uri, element)
            buffer = Buffer(file.data, length, "data" if file.embedded else "resource")
        if len(buffer.data) < length:
            raise element.error(
                "byteLength", f"declares {length:,} bytes, the buffer has {len(buffer.data):,}"
            )
        return buffer

    def named(self, uri: str, element: Element) -> NamedFile:
        """The file that the ``uri`` of a buffer or image means.

        Raises:
            InputError: it is malformed, or no file of its name was sent.
        """
        if uri[:5].lower() == "data:":
            media_type = uri[5:].partition(",")[0].partition(";")[0] or None
            return NamedFile(
                "", _decode_data_uri(uri, element), embedded=True, media_type=media_type
            )
        known = self._sent(uri)
        if known is None:
            name = from_uri(uri)
            if name is None:
                raise element.error("uri", f"'{uri[:80]}' is not the name of a file sent along")
            raise element.error("uri", f"names '{name[:80]}', which was not sent")
        data = self._resources[known]
        refuse_pointer(data, element.place("uri"))
        return NamedFile(known, data, embedded=False)


def encode_data_uri(data: bytes, previous: str | None) -> str:
    """A base64 data URI, with the media type of the one it replaces if that had one."""
    head = _BUFFER_TYPE
    if previous is not None and previous[:5].lower() == "data:":
        before = previous.partition(",")[0]
        if _BASE64.search(before):
            head = before + ","
    return head + base64.b64encode(data).decode("ascii")


def _decode_data_uri(uri: str, element: Element) -> bytes:
    """Decode RFC 2397 data.

    Blanks and missing padding are forgiven, as browsers forgive them (the WHATWG's "forgiving
    base64 decode" and "data: URL processor").
    """
    head, comma, body = uri.partition(",")
    if not comma:
        raise element.error("uri", "the data URI has no comma")
    if not _BASE64.search(head):
        if "base64" in head.lower():
            words = f"expected ';base64' at the end of '{head[:80]}', or no such word"
            raise element.error("uri", words)
        return unquote_to_bytes(body)
    text = "".join(unquote(body).split())
    try:
        return base64.b64decode(text + "=" * (-len(text) % 4), validate=True)
    except (binascii.Error, ValueError):
        raise element.error("uri", "the data URI is not valid base64") from None
