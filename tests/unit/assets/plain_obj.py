"""A reader of OBJ files that shares no code with the project's, for tests."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

_CONTINUED = re.compile(
    rb"(?:[^\r\n#\\]|\\(?:\r\n|\r|\n)|\\(?![\r\n]))*(?:#[^\r\n]*)?(?:\r\n|\r|\n|$)"
)
_TABLES = (b"v", b"vt", b"vn")
_STATES = (b"o", b"g", b"usemtl", b"s")

Values = tuple[float, ...]
Corner = tuple[Values | None, Values | None, Values | None]


@dataclass
class Polygon:
    """A face, line or points: what is in force there, and the values at each corner."""

    keyword: bytes
    state: tuple[bytes, ...]
    corners: list[Corner]


@dataclass
class PlainObj:
    """A file's tables and what it draws; ``others`` are the statements of every other kind."""

    tables: dict[bytes, list[Values]] = field(default_factory=lambda: {key: [] for key in _TABLES})
    drawn: list[Polygon] = field(default_factory=list)
    others: list[bytes] = field(default_factory=list)
    statements: list[bytes] = field(default_factory=list)


def read_plainly(data: bytes) -> PlainObj:
    """Read v, vt, vn, f, l and p; numbers may name what is stated later, or nothing."""
    found = PlainObj()
    state = dict.fromkeys(_STATES, b"")
    waiting = []
    found.statements = _CONTINUED.findall(data)
    for statement in found.statements:
        text = re.sub(rb"\\(?:\r\n|\r|\n)", b" ", statement).partition(b"#")[0]
        words = text.removeprefix(b"\xef\xbb\xbf").split()
        keyword = words[0] if words else b""
        if keyword in found.tables:
            found.tables[keyword].append(tuple(float(word) for word in words[1:]))
        elif keyword in (b"f", b"l", b"p"):
            counts = [len(found.tables[key]) for key in _TABLES]
            polygon = Polygon(keyword, tuple(state.values()), [])
            found.drawn.append(polygon)
            waiting.append((polygon, words[1:], counts))
        else:
            if keyword in state:
                state[keyword] = statement.strip()  # a name may have number signs
            found.others.append(statement)
    for polygon, corners, counts in waiting:
        polygon.corners = [_corner(found, corner, counts) for corner in corners]
    return found


def _corner(found: PlainObj, corner: bytes, counts: list[int]) -> Corner:
    values: list[Values | None] = [None, None, None]
    for place, part in enumerate(corner.split(b"/")):
        table = found.tables[_TABLES[place]]
        index = int(part) if part else 0
        row = index - 1 if index > 0 else counts[place] + index
        if index and 0 <= row < len(table):
            values[place] = table[row]
    return values[0], values[1], values[2]
