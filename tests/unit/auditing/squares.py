"""Assets of squares with one thing wrong, and their audits."""

from __future__ import annotations

from typing import Any

from meshcone.assets import read_asset
from meshcone.auditing.asset import audit_asset
from meshcone.auditing.records import AssetAudit
from meshcone.files import MeshFile
from tests.whole_asset import SQUARE_FACES, Document, png, square


def audit(document: Document) -> AssetAudit:
    data = document.to_bytes()
    return audit_asset(MeshFile("a.gltf", data), read_asset("a.gltf", data))


def audit_obj(data: bytes, **resources: bytes) -> AssetAudit:
    file = MeshFile("a.obj", data, resources)
    return audit_asset(file, read_asset("a.obj", data, resources))


def one_square(**changed: Any) -> Document:
    """A square with one textured material."""
    document = Document()
    arrays = {**square(), **changed}
    attributes = {name: document.accessor(values) for name, values in arrays.items()}
    indices = document.accessor(SQUARE_FACES.reshape(-1, 1))
    primitive = {"attributes": attributes, "indices": indices, "material": 0}
    document.json |= {
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": document.view(png((90, 90, 90), 16, 8))}],
    }
    return document
