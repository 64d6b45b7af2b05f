"""Documents with buffer views compressed with meshopt, as gltfpack writes them."""

from __future__ import annotations

from typing import Any

import meshopt
import numpy as np
from numpy.typing import NDArray

from tests.unit.assets.builders import Gltf, stored

EXT = "EXT_meshopt_compression"


def squeezed(
    gltf: Gltf,
    accessors: list[int] | None = None,
    *,
    name: str = EXT,
    version: int = 0,
    filtered: dict[int, tuple[str, NDArray[Any]]] | None = None,
) -> Gltf:
    """The same document with the views of accessors compressed, as gltfpack writes them.

    Args:
        gltf: every accessor has a view of its own.
        accessors: those to compress; None for all.
        name: of the extension.
        version: of the bitstream.
        filtered: filter and encoded rows of some accessors.
    """
    document = gltf.json
    packed = Gltf()
    packed.json = document | {"bufferViews": []}
    reserved = 0
    indices = {document["meshes"][0]["primitives"][0].get("indices")}
    views = {a: document["accessors"][a]["bufferView"] for a in range(len(document["accessors"]))}
    chosen = set(views if accessors is None else accessors)
    data: list[tuple[dict[str, Any], bytes, dict[str, Any] | None]] = []
    for accessor, view in views.items():
        rows = stored(gltf, accessor)
        kind, encoded = (filtered or {}).get(accessor, ("NONE", rows))
        padding = -encoded.itemsize * encoded.shape[1] % 4
        if accessor not in indices and padding:
            encoded = np.pad(encoded, ((0, 0), (0, padding // encoded.itemsize)))
        stride = encoded.itemsize * encoded.shape[1]
        old = {k: v for k, v in document["bufferViews"][view].items() if k != "byteOffset"}
        if accessor not in chosen:
            data.append((old, rows.tobytes(), None))
            continue
        mode = "TRIANGLES" if accessor in indices else "ATTRIBUTES"
        bits = meshopt.encode_gltf_buffer(
            encoded.reshape(-1) if mode == "TRIANGLES" else encoded, mode, version
        )
        extension = {
            "buffer": 0,
            "byteLength": len(bits),
            "byteStride": stride,
            "count": len(encoded),
            "mode": mode,
        }
        if kind != "NONE":
            extension["filter"] = kind
        plain = old | {"buffer": 1, "byteOffset": reserved, "byteLength": stride * len(encoded)}
        if mode == "ATTRIBUTES":
            plain["byteStride"] = stride
        reserved += stride * len(encoded)
        data.append((plain, bits, extension))
    for view, content, extension in data:
        placed = packed.view(content)
        offset = packed.json["bufferViews"][placed]["byteOffset"]
        if extension is None:
            packed.json["bufferViews"][placed] = view | {"byteOffset": offset}
        else:
            extension["byteOffset"] = offset
            packed.json["bufferViews"][placed] = view | {"extensions": {name: extension}}
    for number, accessor in enumerate(views):
        packed.json["accessors"][accessor]["bufferView"] = number
    packed.json["buffers"] = [
        {"byteLength": 0},
        {"byteLength": reserved, "extensions": {name: {"fallback": True}}},
    ]
    packed.json["extensionsUsed"] = packed.json["extensionsRequired"] = [name]
    return packed
