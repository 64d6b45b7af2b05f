"""PLY, STL and OFF files whose headers promise what is not there."""

from __future__ import annotations

import struct

import numpy as np

from tests.hostile.case import Case, constant

_PLY = (
    "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n"
    "property float z\nelement face {faces}\nproperty list {length} int vertex_indices\n"
    "end_header\n"
)
_POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype="<f4")
_ROWS = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
_FACET = (
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
)
_4_BILLION = 4_294_967_295


def ply_header(
    vertices: int = 4, faces: int = 1, length: str = "uchar", encoding: str = "ascii"
) -> str:
    """The header of a PLY file of points and faces."""
    return _PLY.format(vertices=vertices, faces=faces, length=length, format=encoding)


def ragged(rows: int) -> bytes:
    """A PLY file with an element besides, each row of which is a list and a number."""
    text = f"element a {rows}\nproperty list uchar char b\nproperty char c\nelement vertex"
    head = ply_header(encoding="binary_little_endian").replace("element vertex", text)
    data = b"\1\7\7" + b"\0\7" * (rows - 1) + _POINTS.tobytes() + struct.pack("<B3i", 3, 0, 1, 2)
    return head.encode() + data


def _ascii(title: str, text: str, place: str | None, message: str) -> Case:
    return Case(title, "mesh.ply", constant(text), "input", place, message)


def _binary(title: str, faces: bytes, place: str, message: str, length: str = "uchar") -> Case:
    data = ply_header(length=length, encoding="binary_little_endian").encode()
    return Case(
        title, "mesh.ply", constant(data + _POINTS.tobytes() + faces), "input", place, message
    )


def _binary_points(title: str, points: bytes, place: str | None, message: str) -> Case:
    data = ply_header(encoding="binary_little_endian").encode() + points
    data += struct.pack("<B3i", 3, 0, 1, 2)
    return Case(title, "mesh.ply", constant(data), "input", place, message)


def _stl(title: str, data: bytes | str, place: str | None, message: str) -> Case:
    return Case(title, "mesh.stl", constant(data), "input", place, message)


def _off(title: str, text: str, place: str | None, message: str) -> Case:
    return Case(title, "mesh.off", constant(text), "input", place, message)


def _limit(title: str, name: str, data: bytes | str, place: str, message: str, **caps: int) -> Case:
    return Case(title, name, constant(data), "limit", place, message, limits=caps)


_HEAD = ply_header()

PLY = [
    Case(
        "no elements",
        "mesh.ply",
        constant("ply\nformat ascii 1.0\nend_header\n"),
        "input",
        None,
        "it has no faces",
    ),
    _ascii("no header at all", "ply\nnonsense", None, "'end_header', found the end"),
    _ascii("no format", "ply\nend_header\n", "line 2", "a line with the format, found none"),
    _ascii("unknown format", _HEAD.replace("ascii", "zip"), "line 2", "expected one of ascii"),
    _ascii(
        "format twice", _HEAD.replace("element f", "format\nelement f"), "line 7", "'format' was"
    ),
    _ascii("count of words", _HEAD.replace("vertex 4", "vertex four"), "line 3", "'vertex four'"),
    _ascii("negative count", _HEAD.replace("vertex 4", "vertex -4"), "line 3", "'vertex -4'"),
    _ascii("element twice", _HEAD.replace("face", "vertex"), "line 7", "declared twice"),
    _ascii("property twice", _HEAD.replace("float y", "float x"), "line 5", "declared twice"),
    _ascii("unknown type", _HEAD.replace("float x", "quad x"), "line 4", "found 'quad x'"),
    _ascii("list without type", _HEAD.replace("uchar int v", "v"), "line 8", "found 'list vert"),
    _ascii("list of half lengths", ply_header(length="float"), "line 8", "a whole number"),
    _ascii("property of nothing", _HEAD.replace("element vertex 4\n", ""), "line 3", "'property'"),
    _ascii("no format yet", "ply\nelement a 1\nproperty int b\nend_header\n", "line 3", "format"),
    _ascii("no z", _HEAD.replace("float z", "float w") + _ROWS, "element vertex", "number 'z'"),
    _ascii("no corners", _HEAD.replace("list uchar int", "int") + _ROWS, "element face", "a list"),
    _ascii("float corners", _HEAD.replace("int v", "float v") + _ROWS, "element face", "whole"),
    _ascii("vertices missing", _HEAD + "0 0 0\n", "line 10", "4 rows of .*'vertex', found 1"),
    _ascii("a million vertices missing", ply_header(10**6) + _ROWS, "line 13", "found 4"),
    _ascii("faces missing", _HEAD + _ROWS, "end of the file", "1 rows of .*'face', found 0"),
    _ascii("short vertex", _HEAD + "0 0\n" + _ROWS, "line 10", "3 numbers, found 2"),
    _ascii("word for a number", _HEAD + "0 0 x\n" + _ROWS, "line 10", "a number, found 'x'"),
    _ascii("grouped digits", _HEAD + "0 0 1_0\n" + _ROWS, "line 10", "found '1_0'"),
    _ascii("not a number", _HEAD + "0 0 nan\n" + _ROWS, None, "it has no faces"),
    _ascii("infinite", _HEAD + "0 0 inf\n" + _ROWS, None, "it has no faces"),
    _ascii("too large", _HEAD + "0 0 1e61\n" + _ROWS, "line 10", "found 1e.61"),
    _ascii("short face", _HEAD + _ROWS + "3 0 1\n", "line 14", "3 values .*, found 2"),
    _ascii("negative size", _HEAD + _ROWS + "-3 0 1 2\n", "line 14", "a list of length -3"),
    _ascii("index is a float", _HEAD + _ROWS + "3 0 1 2.0\n", "line 14", "found '2.0'"),
    _ascii("index past the end", _HEAD + _ROWS + "3 0 1 4\n", "line 14", "vertex 4; .*0 to 3"),
    _ascii("negative index", _HEAD + _ROWS + "3 0 1 -1\n", "line 14", "names vertex -1"),
    _ascii("faces without vertices", ply_header(0) + "3 0 1 2\n", "line 10", "there are no vert"),
    _binary(
        "binary index past the end", struct.pack("<B3i", 3, 0, 1, 4), "byte .*", "names vertex 4"
    ),
    _binary(
        "cut short", struct.pack("<B2i", 3, 0, 1), "element face.*byte .*", "12 bytes, found 8"
    ),
    _binary("binary faces missing", b"", "element face, byte .*", "expected 1 bytes, found 0"),
    _binary(
        "list of 4 billion",
        struct.pack("<I3i", _4_BILLION, 0, 1, 2),
        "element face, row 0, byte .*",
        "expected 17,179,869,180 bytes, found 12",
        length="uint",
    ),
    _binary("list of a negative length", struct.pack("<b3i", -3, 0, 1, 2), ".*row 0", "-3", "char"),
    Case(
        "big-endian NaN",
        "mesh.ply",
        constant(ply_header(encoding="binary_big_endian").encode() + b"\x7f\xc0\0\0" + bytes(61)),
        "input",
        None,
        "it has no faces",
    ),
    Case(
        "another element of 4 billion empty rows takes no time",
        "mesh.ply",
        constant(
            ply_header(encoding="binary_little_endian")
            .replace("element vertex", f"element nothing {_4_BILLION}\nelement vertex")
            .encode()
            + _POINTS.tobytes()
            + struct.pack("<B3i", 3, 0, 1, 2)
        ),
        "ok",
    ),
    Case(
        "another element of 4 billion rows",
        "mesh.ply",
        constant(
            ply_header(encoding="binary_little_endian")
            .replace("element vertex", f"element a {_4_BILLION}\nproperty int b\nelement vertex")
            .encode()
            + _POINTS.tobytes()
        ),
        "input",
        "element a, byte .*",
        "expected 17,179,869,180 bytes",
    ),
    _limit("4 billion vertices", "m.ply", ply_header(_4_BILLION), "line 3", "4,294,967,295 vert"),
    _limit("4 billion faces", "m.ply", ply_header(faces=_4_BILLION), "line 7", "4,294,967,295 f"),
    _limit(
        "4 billion strips",
        "m.ply",
        ply_header(faces=_4_BILLION).replace("face", "tristrips"),
        "line 7",
        "4,294,967,295 strips",
    ),
    _limit("ragged rows beside", "m.ply", ragged(6), "element a", "12 numbers and lists", lines=11),
    _limit(
        "ragged faces with much beside",
        "m.ply",
        ply_header(faces=2, encoding="binary_little_endian")
        .replace(
            "property list", "property list uchar int a\nproperty list uchar int b\nproperty list"
        )
        .encode()
        + _POINTS.tobytes()
        + struct.pack("<3B3i", 0, 0, 3, 0, 1, 2)
        + struct.pack("<BiBB3i", 1, 0, 0, 3, 0, 1, 2),
        "element face",
        "6 numbers and lists",
        lines=5,
    ),
    _limit(
        "a polygon of many corners",
        "m.ply",
        _HEAD + _ROWS + "9" * 9 + " 0 1 2\n",
        "line 14",
        "values in a list",
    ),
    Case(
        "a header without an end",
        "mesh.ply",
        constant("ply\nformat ascii 1.0\n" + "comment\n" * 10_000),
        "limit",
        None,
        "80,021 bytes without an 'end_header'",
    ),
]

STL = [
    _stl("empty solid", "solid nothing\nendsolid\n", None, "it has no faces"),
    _stl("solid without an end", "solid nothing", "line 1", "'facet' or 'endsolid' after solid"),
    _stl("cut after a facet", "solid\n" + _FACET, "line 8", "after endfacet, found the end"),
    _stl("cut within a facet", "solid\n" + _FACET[:40], "line 4", "'vertex' after the first vert"),
    _stl(
        "two corners",
        "solid\n" + _FACET.replace("vertex 1 0 0\n", "") + "endsolid",
        "line 6",
        "'vertex' after the second vertex, found 'endloop'",
    ),
    _stl(
        "four corners",
        "solid\n" + _FACET.replace("endloop", "vertex 1 1 1\nendloop") + "endsolid",
        "line 7",
        "'endloop' after the third vertex, found 'vertex'",
    ),
    _stl(
        "short vertex",
        "solid\n" + _FACET.replace("vertex 1 0 0", "vertex 1 0") + "endsolid",
        "line 5",
        "3 numbers, found 2",
    ),
    _stl("word", "solid\n" + _FACET.replace("1 0 0", "1 x 0") + "endsolid", "line 5", "found 'x'"),
    _stl(
        "nan", "solid\n" + _FACET.replace("1 0 0", "1 nan 0") + "endsolid", None, "it has no faces"
    ),
    _stl("too short for binary", b"\0" * 79 + b"x", None, "at least 84 bytes, the file 80"),
    _stl("binary of 4 billion", bytes(80) + b"\xff" * 4 + bytes(50), "byte 80", "found 134"),
    _stl("binary cut short", bytes(80) + b"\2\0\0\0" + bytes(50), "byte 80", "184 bytes .* 134"),
    _stl(
        "binary NaN",
        bytes(80) + b"\1\0\0\0" + bytes(12) + struct.pack("<9fH", *[np.nan] * 9, 0),
        None,
        "it has no faces",
    ),
    _limit("facets", "m.stl", "solid\n" + _FACET * 2 + "endsolid", ".*", "2 triangles", faces=1),
]

SIGNALLING = struct.pack("<I", 0x7FA00000)

STL.append(
    _stl(
        "binary signalling NaN",
        bytes(80) + b"\1\0\0\0" + bytes(12) + SIGNALLING * 9 + bytes(2),
        None,
        "it has no faces",
    )
)
PLY.append(
    _binary_points("signalling NaN", SIGNALLING * 12, None, "it has no faces"),
)

OFF = [
    _off("no counts", "OFF\n", "end of the file", "1 line of counts, found 0"),
    _off("no header", "3 1 0\n", "line 1", "expected 'OFF', found '3 1 0'"),
    _off("words for counts", "OFF\nx y z\n", "line 2", "a count, found 'x'"),
    _off("one count", "OFF\n3\n", "line 2", "the numbers of vertices and faces, found '3'"),
    _off("negative counts", "OFF\n-3 1 0\n", "line 2", "a count, found -3"),
    _off("binary", "OFF BINARY\n", "line 1", "not supported"),
    _off("four dimensions", "4OFF\n1 1 0\n", "line 1", "not supported"),
    _off("vertices missing", "OFF\n3 1 0\n0 0 0\n", "line 3", "3 vertices, found 1"),
    _off("faces missing", "OFF\n4 2 0\n" + _ROWS + "3 0 1 2\n", "line 7", "2 faces, found 1"),
    _off("short vertex", "OFF\n1 0 0\n0 0\n", "line 3", "3 numbers, found 2"),
    _off("short face", "OFF\n4 1 0\n" + _ROWS + "3 0 1\n", "line 7", "3 corners, found 2"),
    _off("negative size", "OFF\n4 1 0\n" + _ROWS + "-3 0 1 2\n", "line 7", "corners, found -3"),
    _off("index past the end", "OFF\n4 1 0\n" + _ROWS + "3 0 1 4\n", "line 7", "names vertex 4"),
    _off("negative index", "OFF\n4 1 0\n" + _ROWS + "3 0 1 -1\n", "line 7", "names vertex -1"),
    _off("fault after comments", "OFF # a\n#\n\n1 0 0\n0 0 x\n", "line 5", "found 'x'"),
    _off("no number of Microsoft's", "OFF\n1 0 0\n0 0 1.#QNAN\n", "line 3", "finite .*1.#QNAN"),
    _off("no faces", "OFF\n4 0 0\n" + _ROWS, None, "it has no faces"),
    _limit("4 billion vertices", "m.off", f"OFF\n{_4_BILLION} 1 0\n", "line 2", "4,294,967,295 v"),
    _limit("4 billion faces", "m.off", f"OFF\n3 {_4_BILLION} 0\n", "line 2", "4,294,967,295 fac"),
    _limit(
        "a polygon of a billion corners",
        "m.off",
        "OFF\n4 1 0\n" + _ROWS + "1000000000 0\n",
        "line 7",
        "999,999,998 triangles",
    ),
]

POINTER = constant("version https://git-lfs.github.com/spec/v1\noid sha256:ab12\nsize 9\n")

OTHER = [
    Case("empty", "mesh.obj", constant(b""), "input", None, "the file is empty"),
    Case("blank", "mesh.obj", constant(b" \r\n\0"), "input", None, "the file is empty"),
    Case("ZIP", "mesh.obj", constant(b"PK\3\4...."), "input", None, "the archive was cut short"),
    Case("bzip2", "mesh.obj.bz2", constant(b"BZh9" + bytes(50)), "input", None, "a bzip2 archive"),
    *(
        Case(f"Git LFS pointer to a .{kind}", f"mesh.{kind}", POINTER, "input", None, "Git LFS")
        for kind in ("obj", "gltf", "glb", "ply", "stl", "off")
    ),
    Case("gzip", "mesh.ply", constant(b"\x1f\x8b\x08"), "input", None, "'end_header'|gzip"),
    Case("a web page", "mesh.dae", constant("<?xml?>"), "input", None, "an XML or HTML document"),
    Case("a letter", "mesh.txt", constant("Dear reader"), "input", None, "not a known kind"),
]

CASES = [*PLY, *STL, *OFF, *OTHER]

BOMBS = [
    Case(
        "a row of 60 million words",
        "mesh.ply",
        lambda: (_HEAD + _ROWS).encode() + b"3" + b" 1" * 60_000_000,
        "input",
        None,
        "its faces have no area",
    ),
    Case(
        "a face of 60 million words",
        "mesh.off",
        lambda: f"OFF\n4 1 0\n{_ROWS}60000000".encode() + b" 1" * 60_000_000,
        "limit",
        "line 7",
        "triangles",
    ),
    Case(
        "200 million empty lines",
        "mesh.stl",
        lambda: b"solid\n" + b"\n" * 200_000_000,
        "limit",
        None,
        "lines",
    ),
    Case(
        "100 million lists of different lengths in the way",
        "mesh.ply",
        lambda: ragged(50_000_000),
        "limit",
        "element a",
        "100,000,000 numbers and lists in rows of different lengths",
    ),
    Case("lists in the way", "mesh.ply", lambda: ragged(1_000_000), "ok"),
    Case(
        "lists of different lengths",
        "mesh.ply",
        lambda: (
            ply_header(faces=400_000, encoding="binary_little_endian").encode()
            + _POINTS.tobytes()
            + (struct.pack("<B3i", 3, 0, 1, 2) + struct.pack("<B4i", 4, 0, 1, 2, 3)) * 200_000
        ),
        "ok",
    ),
]
