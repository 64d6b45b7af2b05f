"""Two exports of one asset: the same file names on both sides, in a folder each."""

from __future__ import annotations

import json
from pathlib import Path

from meshcone.files import MeshFile
from tests import shapes

GATES = {"point_to_surface.max": {"max": 0.01}}
OPTIONS = {
    "mode": "measure",
    "gates": GATES,
    "quality": {"samples": 1000, "emd_samples": 64},
}


def two_exports() -> tuple[MeshFile, MeshFile]:
    """A spiked ball and the ball, whose ``a.gltf`` are equal and whose ``a.bin`` are not."""
    vertices, faces = shapes.sphere(2)
    spiked = vertices.copy()
    spiked[5] *= 1.2
    (_, new), (document, old) = (shapes.gltf(each, faces, "a.bin") for each in (spiked, vertices))
    # Without the bounds, which readers do not need, nothing but the buffer tells them apart.
    plain = json.loads(document)
    for accessor in plain["accessors"]:
        accessor.pop("min", None)
        accessor.pop("max", None)
    data = json.dumps(plain).encode()
    return MeshFile("a.gltf", data, {"a.bin": new}), MeshFile("a.gltf", data, {"a.bin": old})


def write_exports(directory: Path) -> None:
    """Write ``new/``, ``old/``, ``gates.json`` and a manifest ``pairs.csv``."""
    for folder, file in zip(("new", "old"), two_exports(), strict=True):
        (directory / folder).mkdir()
        (directory / folder / file.name).write_bytes(file.data)
        (directory / folder / "a.bin").write_bytes(file.resources["a.bin"])
    (directory / "gates.json").write_text(json.dumps({"gates": GATES}))
    (directory / "pairs.csv").write_text("source,reference\nnew/a.gltf,old/a.gltf\n")
