"""GLB containers that lie about what they contain."""

from __future__ import annotations

import struct
from collections.abc import Callable

from tests.hostile.case import Case
from tests.unit.assets.builders import cube_gltf

_DOCUMENT = b'{"asset":{"version":"2.0"}}\0'.replace(b"\0", b" ")


def _container(*chunks: tuple[bytes, bytes], length: int | None = None) -> bytes:
    body = b"".join(struct.pack("<I", len(data)) + kind + data for kind, data in chunks)
    whole = 12 + len(body) if length is None else length
    return struct.pack("<4sII", b"glTF", 2, whole) + body


def _changed(title: str, change: Callable[[bytes], bytes], place: str | None, message: str) -> Case:
    return Case(title, "mesh.glb", lambda: change(cube_gltf().glb()), "input", place, message)


def _chunks(title: str, chunks: list[tuple[bytes, bytes]], place: str | None, message: str) -> Case:
    return Case(title, "mesh.glb", lambda: _container(*chunks), "input", place, message)


CASES = [
    _changed("half a header", lambda glb: glb[:10], "byte 0", "has 12 bytes, the file 10"),
    _changed("cut short", lambda glb: glb[:-1], "byte 8", "it is cut short"),
    _changed("version 1", lambda glb: glb[:4] + b"\1\0\0\0" + glb[8:], "byte 4", "GLB version 1"),
    _changed(
        "length of nothing", lambda glb: glb[:8] + bytes(4) + glb[12:], "byte 8", "only 0 bytes"
    ),
    _changed(
        "4 billion bytes", lambda glb: glb[:8] + b"\xff" * 4 + glb[12:], "byte 8", "4,294,967,295"
    ),
    _changed(
        "chunk of 4 billion bytes",
        lambda glb: glb[:12] + b"\xff" * 4 + glb[16:],
        "byte 12",
        "a chunk declares 4,294,967,295 bytes",
    ),
    _changed("buffer first", lambda glb: glb[:16] + b"BIN\0" + glb[20:], "byte 12", "not JSON"),
    _changed(
        "half a chunk header",
        lambda glb: glb[:8] + struct.pack("<I", len(glb) + 4) + glb[12:] + b"\0\0\0\0",
        r"byte \d+",
        "within a chunk's header",
    ),
    _chunks("two documents", [(b"JSON", _DOCUMENT)] * 2, "byte 48", "more than one JSON chunk"),
    _chunks(
        "buffer third",
        [(b"JSON", _DOCUMENT), (b"MORE", b""), (b"BIN\0", b"")],
        "byte 56",
        "can only be the second chunk",
    ),
    _chunks("empty document", [(b"JSON", b"")], "line 1, column 1", "malformed"),
    Case(
        "more chunks than accepted",
        "mesh.glb",
        lambda: _container((b"JSON", _DOCUMENT), *[(b"MORE", b"")] * 2),
        "limit",
        r"byte \d+",
        "3 chunks; .* accepts 2",
        limits={"chunks": 2},
    ),
    Case(
        "unknown chunks and bytes after the end are carried along",
        "mesh.glb",
        lambda: (
            struct.pack("<4sII", b"glTF", 2, len(cube_gltf().glb()) + 12)
            + cube_gltf().glb()[12:]
            + struct.pack("<I", 4)
            + b"MOREmore"
            + b"after"
        ),
        "ok",
    ),
]

BOMBS = [
    Case(
        "25 million empty chunks",
        "mesh.glb",
        lambda: (
            _container((b"JSON", _DOCUMENT), *[(b"MORE", b"")] * 1)[:12].replace(
                struct.pack("<I", 12 + 8 + len(_DOCUMENT) + 8),
                struct.pack("<I", 12 + 8 + len(_DOCUMENT) + 8 * 25_000_000),
            )
            + struct.pack("<I", len(_DOCUMENT))
            + b"JSON"
            + _DOCUMENT
            + (struct.pack("<I", 0) + b"MORE") * 25_000_000
        ),
        "limit",
        r"byte \d+",
        "1,001 chunks",
    ),
]
