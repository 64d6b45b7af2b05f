"""What differs between two glTF files, read without the engine's own readers.

A check of what the engine writes must not rest on how the engine reads.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from stored import accessor_bytes, buffer_bytes, document_and_binary

WRITTEN = ("POSITION", "NORMAL", "TANGENT")
DRACO = "KHR_draco_mesh_compression"
# What moving vertices takes, by JSON pointer. The names are those of the table.
EXPECTED = {
    "bounds": r"/accessors/\d+/(min|max)(/\d+)?",
    "buffers": r"/buffers/\d+/(uri|byteLength)",
    "copies": r"/(meshes|accessors|bufferViews|buffers)/\+|/nodes/\d+/mesh"
    r"|/meshes/\d+/primitives/\d+/attributes/(POSITION|NORMAL|TANGENT)",
    "widened": r"/accessors/\d+/(componentType|normalized|bufferView|byteOffset)",
    "moved views": r"/bufferViews/\d+/(byteOffset|byteLength|target|byteStride)",
    "draco": rf"/meshes/\d+/primitives/\d+/extensions(/{DRACO}(/.*)?)?"
    r"|/extensions(Used|Required)(/.*)?",
}


def json_changes(before: Any, after: Any, pointer: str = "") -> Iterator[str]:
    """JSON pointers of what differs; ``+`` stands for entries appended to an array."""
    if isinstance(before, dict) and isinstance(after, dict):
        if [key for key in after if key in before] != [key for key in before if key in after]:
            yield f"{pointer}: order of members"
        for key in before.keys() | after.keys():
            here = f"{pointer}/{key}"
            if key in before and key in after:
                yield from json_changes(before[key], after[key], here)
            else:
                yield here
    elif isinstance(before, list) and isinstance(after, list) and len(before) <= len(after):
        for index, (one, other) in enumerate(zip(before, after, strict=False)):
            yield from json_changes(one, other, f"{pointer}/{index}")
        if len(after) > len(before):
            yield f"{pointer}/+"
    elif before != after or type(before) is not type(after):
        yield pointer


def kind_of(pointer: str, document: dict[str, Any]) -> str | None:
    """Which expected kind of change a pointer is, or None.

    Of accessors only those that are written may change; where Draco compresses some, all may,
    for decompressing does not quite restore what the bounds were taken from.
    """
    found = next((name for name, form in EXPECTED.items() if re.fullmatch(form, pointer)), None)
    accessor = re.match(r"/accessors/(\d+)/", pointer)
    if accessor and DRACO not in document.get("extensionsUsed", []):
        return found if int(accessor[1]) in written_accessors(document) else None
    return found


def changed_elsewhere(before: bytes, after: bytes, resources: Mapping[str, bytes]) -> Iterator[str]:
    """What holds other bytes although nothing that is written reads it.

    Accessors that come from or go into a Draco bitstream in either file are left out, for
    their bytes are not there to be compared.
    """
    (old, old_binary), (new, new_binary) = map(document_and_binary, (before, after))
    old_buffers = [buffer_bytes(entry, old_binary, resources) for entry in old.get("buffers", [])]
    new_buffers = [buffer_bytes(entry, new_binary, resources) for entry in new.get("buffers", [])]
    written = written_accessors(old)
    for index, accessor in enumerate(old.get("accessors", [])):
        both = "bufferView" in accessor and "bufferView" in new["accessors"][index]
        if index in written or not both:
            continue
        if accessor_bytes(old, old_buffers, index) != accessor_bytes(new, new_buffers, index):
            yield f"/accessors/{index}"
    for index, image in enumerate(old.get("images", [])):
        if "bufferView" in image:
            number = image["bufferView"]
            if view_bytes(old, old_buffers, number) != view_bytes(new, new_buffers, number):
                yield f"/images/{index}"


def written_accessors(document: dict[str, Any]) -> set[int]:
    """Accessors that hold positions, normals or tangents."""
    return {
        primitive["attributes"][name]
        for mesh in document.get("meshes", [])
        for primitive in mesh["primitives"]
        for name in WRITTEN
        if name in primitive["attributes"]
    }


def view_bytes(document: dict[str, Any], buffers: list[bytes], index: int) -> bytes:
    """The bytes of a buffer view."""
    view = document["bufferViews"][index]
    start = view.get("byteOffset", 0)
    return buffers[view["buffer"]][start : start + view["byteLength"]]
