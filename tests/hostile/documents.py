"""JSON that is no glTF, or too much of it."""

from __future__ import annotations

from tests.hostile.case import Case, constant

HEAD = b'{"asset": {"version": "2.0"}'


def _input(title: str, data: bytes, place: str | None, message: str) -> Case:
    return Case(title, "mesh.gltf", constant(data), "input", place, message)


def _limit(title: str, data: bytes, place: str | None, message: str, **limits: int) -> Case:
    return Case(title, "mesh.gltf", constant(data), "limit", place, message, limits=limits)


CASES = [
    _input("cut short", b'{"asset": ', "line 1, column 11", "malformed"),
    _input("string without an end", b'{"a": "\\' + b'\\"' * 10**5, "line 1, .*", "malformed"),
    _input("comment", HEAD + b"\n// more\n}", "line 2, column 1", "malformed"),
    _input("trailing garbage", HEAD + b"}}", "line 1, column 30", "malformed"),
    _input("not a number", HEAD + b',\n "a": NaN}', "line 2, column 7", "found NaN"),
    _input("infinity", HEAD + b', "a": -Infinity}', "line 1, .*", "found -Infinity"),
    _input(
        "number of 5,000 digits", b'{"a": ' + b"9" * 5000 + b"}", "line 1, column 7", "found 5,000"
    ),
    _input("digits and more", b'{"a": ' + b"9" * 5000 + b"x}", "line 1, column 7", "found 5,000"),
    _input("a constant and more", b'{"a": NaNa}', "line 1, column 7", "found NaN"),
    _input("not UTF-8", b'{"asset": "\xff"}', "byte 11", "not UTF-8"),
    _input("UTF-16", HEAD.decode().encode("utf-16-le"), "byte 0|line 1.*", ""),
    _input(
        "a name twice",
        b'{"a": {"b": 0}, "b": [{}, {"b": 0,\n"\\u0062": 0}]}',
        "line 2, column 1",
        "an object has two members 'b'",
    ),
    _input("no asset", b"{}", "/asset", "'asset' is missing"),
    _input("glTF 1.0", b'{"asset": {"version": "1.0"}}', "/asset/version", "'1.0'; expected 2.0"),
    _input("version no text", b'{"asset": {"version": []}}', "/asset/version", "a finite number"),
    _input("version null", b'{"asset": {"version": null}}', "/asset/version", "version ''"),
    _input(
        "needs a later version",
        b'{"asset": {"version": "2.1", "minVersion": "2.1"}}',
        "/asset/minVersion",
        "needs glTF '2.1'",
    ),
    _input("nothing in it", HEAD + b"}", None, "it has no faces"),
    _input("an array for an object", HEAD + b', "nodes": {}}', "/nodes", "an array, found an obj"),
    _input("null in an array", HEAD + b', "nodes": [null]}', "/nodes/0", "an object, found null"),
    _limit("deep arrays", b'{"a":' + b"[" * 100_000, None, "100,001 nested levels"),
    _limit("deep objects", b'{"a":' * 65, None, "65 nested levels of JSON; .* 64"),
    _limit("long", HEAD + b" " * 99 + b"}", None, "bytes of JSON", json_bytes=100),
    _limit("many values", HEAD + b', "a": [1,2,3,4,5,6]}', None, "values", json_values=8),
    _limit("many nodes", HEAD + b', "nodes": [{},{}]}', "/nodes", "2 nodes", nodes=1),
    _limit("accessors", HEAD + b', "accessors": [{},{}]}', "/accessors", "2 acc", accessors=1),
    _limit("many meshes", HEAD + b', "meshes": [{},{}]}', "/meshes", "2 meshes", meshes=1),
]

BOMBS = [
    Case(
        "40 million empty arrays",
        "mesh.gltf",
        lambda: b'{"a":[' + b"[]," * 40_000_000 + b"[]]}",
        "limit",
        None,
        "values of JSON",
    ),
    Case(
        "100 million quotes",
        "mesh.gltf",
        lambda: b'{"a":"' + b'\\"' * 50_000_000,
        "input",
        ".*",
        "malformed",
    ),
    Case(
        "brackets in a string are no depth",
        "mesh.gltf",
        lambda: HEAD + b', "a": "' + b"[" * 10_000_000 + b'"}',
        "input",
        None,
        "it has no faces",
    ),
]
