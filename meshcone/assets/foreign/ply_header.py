"""Reads the header of a PLY file.

Source: G. Turk, "The PLY Polygon File Format" (1994): elements in the order of their data, each
with a count and properties; a property is a number or a list with its length before it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from meshcone.assets.foreign.text import shown
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

Encoding = Literal["ascii", "<", ">"]

_ENCODINGS: dict[bytes, Encoding] = {
    b"ascii": "ascii",
    b"binary_little_endian": "<",
    b"binary_big_endian": ">",
}
_TYPES = {
    b"char": "i1",
    b"int8": "i1",
    b"uchar": "u1",
    b"uint8": "u1",
    b"short": "i2",
    b"int16": "i2",
    b"ushort": "u2",
    b"uint16": "u2",
    b"int": "i4",
    b"int32": "i4",
    b"uint": "u4",
    b"uint32": "u4",
    b"float": "f4",
    b"float32": "f4",
    b"double": "f8",
    b"float64": "f8",
}
_CAPS = {
    b"vertex": ("vertices", "vertices"),
    b"face": ("faces", "faces"),
    b"tristrips": ("faces", "strips of triangles"),
}
_KEYWORDS = (b"format", b"element", b"property")
_READ = frozenset(b"x y z nx ny nz vertex_index vertex_indices".split())
_END = re.compile(rb"(?:^|[\r\n])[ \t]*end_header[ \t]*(\r\n|\n|\r)")
_COUNT = re.compile(rb"\d{1,18}")


@dataclass(frozen=True)
class Property:
    """A number of each row, or a list of them if ``length`` has a type."""

    name: bytes
    values: np.dtype[Any]
    length: np.dtype[Any] | None


@dataclass(frozen=True)
class Element:
    """A table of the file."""

    name: bytes
    count: int
    properties: tuple[Property, ...]

    @property
    def place(self) -> str:
        """What messages call it in a binary file, which has no lines."""
        return f"element {shown(self.name)}"

    @property
    def has_lists(self) -> bool:
        """Whether rows differ in length."""
        return any(item.length is not None for item in self.properties)

    @property
    def least_bytes(self) -> int:
        """Bytes of a binary row whose lists are all empty."""
        return sum((item.length or item.values).itemsize for item in self.properties)


@dataclass(frozen=True)
class Header:
    """A PLY file's header.

    Attributes:
        encoding: ``ascii``, or the byte order of numbers.
        elements: in the order of their data.
        size: bytes up to where the data begin.
        lines: lines up to there.
    """

    encoding: Encoding
    elements: tuple[Element, ...]
    size: int
    lines: int


def read_header(data: bytes, limits: Limits) -> Header:
    """Read and check a header.

    Raises:
        InputError: with the line at fault.
        LimitError: it is longer, or declares more, than ``limits`` accept.
    """
    end = _END.search(data[: limits.header_bytes])
    if end is None:
        if len(data) > limits.header_bytes:
            limits.check("header_bytes", len(data), "bytes without an 'end_header'")
        raise InputError("expected 'end_header', found the end of the file")
    size = end.end()
    first = data[:16].lstrip()  # blanks are where a byte order mark was
    if first[:4] == b"ply\r" and first[4:5] != b"\n":
        size = end.start(1) + 1  # lines end with \r here: a \n after it is data
    lines = data[: end.start(1)].splitlines()
    encoding = None
    elements: list[tuple[bytes, int, list[Property]]] = []
    for number, line in enumerate(lines[1:-1], 2):
        words = line.split()
        place = f"line {number}"
        # Comments, and remarks of exporters that forgot to call them so.
        if not words or words[0] not in _KEYWORDS:
            continue
        if words[0] == b"format" and encoding is None:
            encoding = _encoding(words, place)
        elif words[0] == b"element":
            elements.append(
                (*_element(words, {name for name, _, _ in elements}, limits, place), [])
            )
        elif words[0] == b"property" and elements:
            _add_property(elements[-1][2], words, "" if encoding == "ascii" else encoding, place)
        else:
            raise InputError(f"'{shown(words[0])}' was not expected here", place=place)
    if encoding is None:
        raise InputError("expected a line with the format, found none", place="line 2")
    found = tuple(Element(name, count, tuple(properties)) for name, count, properties in elements)
    return Header(encoding, found, size, len(lines))


def _encoding(words: list[bytes], place: str) -> Encoding:
    if len(words) != 3 or words[1] not in _ENCODINGS:
        known = ", ".join(name.decode() for name in _ENCODINGS)
        found = shown(b" ".join(words[1:]))
        raise InputError(f"expected one of {known} and a version, found '{found}'", place=place)
    return _ENCODINGS[words[1]]


def _element(
    words: list[bytes], known: set[bytes], limits: Limits, place: str
) -> tuple[bytes, int]:
    if len(words) != 3 or not _COUNT.fullmatch(words[2]):
        found = shown(b" ".join(words[1:]))
        raise InputError(f"expected an element's name and count, found '{found}'", place=place)
    name, count = words[1], int(words[2])
    if name in known:
        raise InputError(f"element '{shown(name)}' is declared twice", place=place)
    if name in _CAPS:
        cap, what = _CAPS[name]
        limits.check(cap, count, what, place)
    return name, count


def _add_property(
    properties: list[Property], words: list[bytes], order: str | None, place: str
) -> None:
    if order is None:
        raise InputError("expected the format before the first property", place=place)
    is_list = words[1:2] == [b"list"]
    types = words[2:-1] if is_list else words[1:-1]
    if len(types) != (2 if is_list else 1) or not all(name in _TYPES for name in types):
        found = shown(b" ".join(words[1:]))
        raise InputError(f"expected a property's type and name, found '{found}'", place=place)
    name = words[-1]
    if name in {item.name for item in properties}:
        if name in _READ:
            raise InputError(f"property '{shown(name)}' is declared twice", place=place)
        name = b"%s %d" % (name, len(properties))  # a name that no file can declare
    length, values = None, np.dtype(order + _TYPES[types[-1]])
    if is_list:
        length = np.dtype(order + _TYPES[types[0]])
        if length.kind == "f":
            raise InputError("expected a list whose length is a whole number", place=place)
    properties.append(Property(name, values, length))
