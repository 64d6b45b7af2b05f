"""Small surfaces with colours: a globe with a textured skin, and pictures for it."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from tests.whole_asset import Document

Pixels = NDArray[np.uint8]


def picture(width: int = 64, height: int = 32, seed: int = 3) -> Pixels:
    """(h, w, 3) soft patches of many colours, which no mirroring maps onto themselves."""
    coarse = np.random.default_rng(seed).integers(0, 256, (4, 8, 3), dtype=np.uint8)
    return np.asarray(Image.fromarray(coarse).resize((width, height), Image.Resampling.BICUBIC))


def encoded(pixels: Pixels, kind: str = "PNG", **how: Any) -> bytes:
    """A picture as a file."""
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, kind, **how)
    return out.getvalue()


def globe(around: int = 32, along: int = 16) -> dict[str, NDArray[Any]]:
    """Positions, coordinates and triangles of a sphere whose texture is a map of the world."""
    u, v = np.meshgrid(np.linspace(0, 1, around + 1), np.linspace(0, 1, along + 1))
    east, south = 2 * np.pi * u.ravel(), np.pi * v.ravel()
    # The last column lies on the first, to the bit, where the seam is.
    east[around :: around + 1] = 0
    points = [np.sin(south) * np.cos(east), np.cos(south), -np.sin(south) * np.sin(east)]
    number = np.arange((around + 1) * (along + 1)).reshape(along + 1, around + 1)
    a, b = number[:-1, :-1].ravel(), number[:-1, 1:].ravel()
    c, d = number[1:, :-1].ravel(), number[1:, 1:].ravel()
    faces = np.concatenate([np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)])
    return {
        "POSITION": np.stack(points, axis=1).astype("<f4"),
        "TEXCOORD_0": np.stack([u.ravel(), v.ravel()], axis=1).astype("<f4"),
        "faces": faces.astype("<u2"),
    }


def painted(
    image: bytes | None = None,
    arrays: dict[str, NDArray[Any]] | None = None,
    *,
    material: dict[str, Any] | None = None,
    sampler: dict[str, Any] | None = None,
    texture: dict[str, Any] | None = None,
) -> bytes:
    """A glTF file with one material.

    Args:
        image: its texture, if it has one.
        arrays: as :func:`globe` makes them.
        material: members of it besides the texture.
        sampler: of the texture.
        texture: members of the reference to the texture.
    """
    arrays = dict(arrays or globe())
    faces = arrays.pop("faces")
    document = Document()
    attributes = {name: document.accessor(values) for name, values in arrays.items()}
    indices = document.accessor(faces.reshape(-1, 1))
    looks: dict[str, Any] = {"pbrMetallicRoughness": {}, **(material or {})}
    if image is not None:
        looks["pbrMetallicRoughness"] = {
            **looks["pbrMetallicRoughness"],
            "baseColorTexture": {"index": 0, **(texture or {})},
        }
        document.json |= {
            "images": [{"bufferView": document.view(image), "mimeType": "image/png"}],
            "samplers": [sampler or {}],
            "textures": [{"source": 0, "sampler": 0}],
        }
    primitive = {"attributes": attributes, "indices": indices, "material": 0}
    document.json |= {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [looks],
    }
    return document.to_bytes()


def painted_obj(arrays: dict[str, NDArray[Any]] | None = None, name: str = "skin") -> bytes:
    """The same surface as an OBJ file that names the library ``a.mtl``."""
    arrays = arrays or globe()
    lines = ["mtllib a.mtl", f"usemtl {name}"]
    lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in arrays["POSITION"]]
    lines += [f"vt {u:.9g} {1 - v:.9g}" for u, v in arrays["TEXCOORD_0"]]
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in arrays["faces"].astype(int) + 1]
    return ("\n".join(lines) + "\n").encode()
