"""A glTF whose triangles were divided: textures, colours and skins are those of the source."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from meshcone.files import MeshFile
from meshcone.verbs.verify import verify
from tests.shapes import glb, noisy, sphere
from tests.unit.assets.builders import Gltf, chunks
from tests.unit.engine.evidence import Evidence

FEW: dict[str, Any] = {"samples": 500, "emd_samples": 16, "curvature_samples": 16}
OPTIONS: dict[str, Any] = {"effort": "fast", "quality": FEW, "detail": {"growth": 3}}
REFERENCE = MeshFile("reference.glb", glb(*sphere(3)))


def skinned_ball() -> bytes:
    """Nine joints at rest, three at each vertex, so that four hold too little of two vertices."""
    vertices, faces = sphere(1)
    positions = noisy(vertices, 0.02).astype(np.float32)
    count = len(positions)
    draw = np.random.default_rng(5)
    weights = np.zeros((count, 4), dtype=np.float32)
    weights[:, :3] = draw.dirichlet([1, 1, 1], count)
    joints = np.zeros((count, 4), dtype=np.uint8)
    joints[:, :3] = [draw.choice(9, 3, replace=False) for _ in range(count)]
    gltf = Gltf()
    attributes = {
        "POSITION": gltf.accessor(positions),
        "TEXCOORD_0": gltf.accessor(draw.uniform(0, 1, (count, 2)).astype(np.float32)),
        "COLOR_0": gltf.accessor(
            draw.integers(0, 256, (count, 4)).astype(np.uint8), normalized=True
        ),
        "JOINTS_0": gltf.accessor(joints),
        "WEIGHTS_0": gltf.accessor(weights),
    }
    primitive = {
        "attributes": attributes,
        "indices": gltf.accessor(faces.astype(np.uint16).ravel()),
    }
    gltf.node(mesh=gltf.mesh(primitive), skin=0)
    gltf.json["skins"] = [{"joints": [gltf.node() for _ in range(9)]}]
    return gltf.glb()


@pytest.fixture(scope="module")
def honest() -> Evidence:
    return Evidence.of(MeshFile("ball.glb", skinned_ball()), REFERENCE, OPTIONS)


def attributes_line(evidence: Evidence) -> tuple[bool, str]:
    stored = MeshFile("certificate.npz", evidence.certificate.to_bytes())
    files = (evidence.source, evidence.reference, evidence.refined)
    checks = verify(evidence.report, stored, *files).checks
    return next((check.ok, check.words) for check in checks if check.name == "attributes")


def with_last(honest: Evidence, name: str, change: float) -> Evidence:
    """The refined file with the last number of an attribute changed, and hashes of its own."""
    data = bytearray(honest.refined.data)
    document, binary = chunks(bytes(data))
    accessor = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"][name]]
    view = document["bufferViews"][accessor["bufferView"]]
    columns = {"VEC2": 2, "VEC4": 4}[accessor["type"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    end = data.find(binary) + start + 4 * columns * accessor["count"]
    values = np.frombuffer(data[end - 4 * columns : end], dtype="<f4").copy()
    values[0] += change
    data[end - 4 * columns : end] = values.tobytes()
    changed = replace(honest, refined=replace(honest.refined, data=bytes(data)))
    return changed.with_forged_hashes()


def test_a_skinned_and_coloured_file_is_proven(honest: Evidence) -> None:
    assert honest.failed() == set()
    ok, words = attributes_line(honest)
    assert ok
    assert words.startswith(
        "COLOR_0, TEXCOORD_0, materials: what lies there in the source, to 0.00"
    )
    assert "; skins: the joints around, but for 0." in words


@pytest.mark.parametrize(
    ("name", "found"), [("TEXCOORD_0", "TEXCOORD_0 of face"), ("WEIGHTS_0", "the skin of face")]
)
def test_a_number_changed_by_a_hundredth_fails(honest: Evidence, name: str, found: str) -> None:
    ok, words = attributes_line(with_last(honest, name, 0.01))
    assert not ok
    assert words.startswith(found)
