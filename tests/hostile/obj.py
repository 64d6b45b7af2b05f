"""OBJ files no reader likes."""

from __future__ import annotations

from collections.abc import Callable

from tests.hostile.case import Case, constant

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


def _input(title: str, text: str | bytes, place: str | None, message: str) -> Case:
    return Case(title, "mesh.obj", constant(text), "input", place, message)


def _limit(title: str, text: str, place: str | None, message: str, **limits: int) -> Case:
    return Case(title, "mesh.obj", constant(text), "limit", place, message, limits=limits)


def _bomb(title: str, make: Callable[[], bytes], place: str | None, message: str) -> Case:
    return Case(title, "mesh.obj", make, "limit", place, message)


CASES = [
    _input("index 0 wraps to the last vertex", CORNERS + "f 0 1 2", "line 5", "names vertex 0"),
    _input("index past the end", CORNERS + "f 1 2 5", "line 5", "names vertex 5; .* 1 to 4"),
    _input("index before the start", CORNERS + "f -5 1 2", "line 5", "names vertex -5"),
    _input(
        "relative index to a vertex stated later",
        "v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 1 0\n",
        "line 3",
        "names vertex -3",
    ),
    _input("index of 30 digits", CORNERS + "f 1 2 " + "9" * 30, "line 5", "names vertex"),
    _input("index of a million digits", CORNERS + "f 1 2 " + "9" * 10**6, "line 5", "names vertex"),
    _input("word for an index", CORNERS + "f 1 2 x", "line 5", "like 1/2/3, found 'x'"),
    _input("float for an index", CORNERS + "f 1 2 3.0", "line 5", "found '3.0'"),
    _input("four indices in a corner", CORNERS + "f 1 2 1/2/3/4", "line 5", "found '1/2/3/4'"),
    _input("corner without vertex", CORNERS + "f 1 2 /3", "line 5", "found '/3'"),
    _input("two indices run together", CORNERS + "f 1-2 - 4", "line 5", "found '1-2'"),
    _input("grouped digits", CORNERS + "f 1 2 1_0", "line 5", "found '1_0'"),
    _input("NUL in an index", CORNERS + "f 1 2 3\0", "line 5", "found '3\0'"),
    _input("not a number", "v 0 0 0\nv 1 nan 0\n", "line 2", "a finite number, found 'nan'"),
    _input("Microsoft's no number", "v 0 0 -1.#IND\n", "line 1", "finite .* found '-1.#IND'"),
    _input("its infinity", "v 1.#INF00 0 0\n", "line 1", "a finite .* found '1.#INF00'"),
    _input("infinite", "v 0 0 0\nv 1 -inf 0\n", "line 2", "a finite number, found '-inf'"),
    _input("larger than any number", "v 0 1e999 0\n", "line 1", "found '1e999'"),
    _input("larger than any model", "v 0 0 1e61\n", "line 1", "at most 1e.60, found '1e61'"),
    _input("decimal comma", "v 1,5 0 0\n", "line 1", "found '1,5'"),
    _input("missing coordinate", "v 0 0 0\nv 1 0\n", "line 2", "3 coordinates, found 2"),
    _input("coordinate behind a comment", "v 0 0 # 0\n", "line 1", "3 coordinates, found 2"),
    _input("bare keyword", "v\n", "line 1", "3 coordinates, found 0"),
    _input(
        "fault after continued lines", "v 0 0 \\\n0\n\nv a 0 0\n", "line 4", "number, found 'a'"
    ),
    _input("continued past the end", CORNERS + "f 1 2 \\", "line 5", "found '\\\\'"),
    _input("faces without vertices", "f 1 2 3\n", "line 1", "the file has no vertices"),
    _input("vertices without faces", CORNERS, None, "it has no faces"),
    _input("faces without area", CORNERS + "f 1 1 2\n", None, "its faces have no area"),
    _input("only lines and points", CORNERS + "l 1 2\np 3\n", None, "it has no faces"),
    _input("UTF-16", CORNERS.encode("utf-16"), "line 1", "UTF-16"),
    _limit("vertices", CORNERS, "line 4", "4 vertices; .* accepts 3", vertices=3),
    _limit("normals", "vn 0 0 1\n" * 4, "line 4", "4 normals; .* accepts 3", vertices=3),
    _limit("triangles", CORNERS + "f 1 2 3 4", "line 5", "2 triangles; .* accepts 1", faces=1),
    _limit("lines", "\r\n" * 9 + CORNERS, None, "14 lines; .* accepts 13", lines=13),
    _limit("bytes", CORNERS, None, "32 bytes; .* accepts 31", file_bytes=31),
    Case(
        "continuation joins what a comment does not",
        "mesh.obj",
        constant("# C:\\\n" + CORNERS + "f 1 \\\n2 3\n"),
        "ok",
    ),
]

_MANY = 13_000_000

BOMBS = [
    _bomb("line ends", lambda: CORNERS.encode() + b"\n" * 200_000_000, None, "200,000,005 lines"),
    _bomb("a keyword a line", lambda: b"v\n" * _MANY, None, "13,000,001 lines"),
    _bomb(
        "one face of 60 million corners",
        lambda: CORNERS.encode() + b"f" + b" 1" * 60_000_000,
        "line 5",
        "triangles",
    ),
    Case(
        "one vertex of 60 million weights",
        "mesh.obj",
        lambda: CORNERS.encode() + b"v 1 1 1" + b" 1" * 60_000_000 + b"\nf 1 2 3",
        "ok",
    ),
    Case(
        "a name of 60 million words",
        "mesh.obj",
        lambda: CORNERS.encode() + b"o" + b" 1" * 60_000_000 + b"\nf 1 2 3",
        "ok",
    ),
    Case(
        "long names multiplied by each other",
        "mesh.obj",
        lambda: (
            CORNERS.encode()
            + b"o "
            + b"x" * 1_000_000
            + b"\n"
            + b"".join(b"usemtl %d\nf 1 2 3\n" % k for k in range(20_000))
        ),
        "ok",
    ),
    Case(
        "as many materials as lines",
        "mesh.obj",
        lambda: CORNERS.encode() + b"usemtl a\nusemtl b\nf 1 2 3\n" * 20_000,
        "ok",
    ),
    Case(
        "concave polygons of many sizes",
        "mesh.obj",
        lambda: (
            b"v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\n"
            + b"".join(b"f" + b" 1 2 3 4" * k + b"\n" for k in range(1, 400))
        ),
        "ok",
    ),
]
