"""Refinements whose files need more than moved positions hold up to verification."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import trimesh

from meshcone.assets import read_asset
from meshcone.assets.obj.asset import ObjAsset
from meshcone.errors import InputError, InternalError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.refine import refine
from tests import shapes
from tests.unit.assets.builders import Gltf, compress
from tests.unit.assets.squeezing import squeezed
from tests.unit.engine.evidence import Evidence
from tests.unit.engine.pairs import RADIUS, rough, smooth

CLOSER = 0.5  # of the input's distance


def ball(scale: float = 1.0, dtype: str = "f4", **node: Any) -> Gltf:
    """A ball with noise, its positions stored in a type and a scale."""
    vertices, faces = shapes.sphere(2, RADIUS)
    gltf = Gltf()
    position = gltf.accessor((shapes.noisy(vertices) / scale).astype(dtype))
    indices = gltf.accessor(faces.reshape(-1).astype("u2"))
    primitive = {"attributes": {"POSITION": position}, "indices": indices}
    gltf.node(mesh=gltf.mesh(primitive), name="one", scale=[scale] * 3, **node)
    return gltf


def quantized() -> Gltf:
    gltf = ball(2.2 / 32767, "i2")
    gltf.json["extensionsUsed"] = gltf.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    return gltf


def two_balls() -> Gltf:
    gltf = ball()
    gltf.node(mesh=0, name="two", translation=[6, 0, 0])
    return gltf


def smooth_pair() -> MeshFile:
    vertices, faces = shapes.sphere(3, RADIUS)
    both = np.concatenate([vertices, vertices + np.array([6, 0, 0])])
    return MeshFile("pair.obj", shapes.obj(both, np.concatenate([faces, faces + len(vertices)])))


FAST = {"effort": "fast"}


@pytest.mark.parametrize(
    ("source", "reference", "options"),
    [
        (quantized(), smooth(), FAST),
        (compress(ball()), smooth(), FAST),
        (compress(ball()), smooth(), {**FAST, "draco": "encode"}),
        (squeezed(ball()), smooth(), {**FAST, "meshopt": "encode"}),
        (two_balls(), smooth_pair(), FAST),
        (two_balls(), smooth_pair(), {**FAST, "instances": "split"}),
        (
            two_balls(),
            smooth_pair(),
            {**FAST, "instances": "split", "select": {"nodes": ["two"]}},
        ),
    ],
    ids=[
        "quantized",
        "draco",
        "draco again",
        "meshopt again",
        "shared",
        "split",
        "split and selected",
    ],
)
def test_it_comes_closer_and_verifies(source: Gltf, reference: MeshFile, options: dict) -> None:
    evidence = Evidence.of(MeshFile("rough.glb", source.glb()), reference, options)
    quality = evidence.report.quality
    assert quality.refined is not None
    limit = CLOSER if "select" not in options else 0.9
    distance = quality.refined.point_to_surface.mean
    assert distance < limit * quality.input.point_to_surface.mean
    assert evidence.failed() == set()


@pytest.mark.parametrize("kind", ["ply", "stl", "off"])
def test_a_mesh_of_polygons_alone_comes_closer_and_verifies(kind: str) -> None:
    vertices, faces = shapes.sphere(2, RADIUS)
    mesh = trimesh.Trimesh(shapes.noisy(vertices, seed=7), faces, process=False)
    data = mesh.export(file_type=kind)
    source = MeshFile(f"rough.{kind}", data if isinstance(data, bytes) else data.encode())

    evidence = Evidence.of(source, smooth(), FAST)

    quality = evidence.report.quality
    assert quality.refined is not None
    assert quality.refined.point_to_surface.mean < CLOSER * quality.input.point_to_surface.mean
    assert evidence.failed() == set()


def test_what_is_not_selected_stays_to_the_bit():
    source = MeshFile("rough.glb", two_balls().glb())
    options = {**FAST, "instances": "split", "select": {"nodes": ["two"]}}
    answer = refine(source, smooth_pair(), parse_options(options))
    before, after = (read_asset("m.glb", data) for data in (source.data, answer.data))
    half = len(before.positions) // 2
    assert np.array_equal(after.positions[:half], before.positions[:half])
    assert (after.positions[half:] != before.positions[half:]).any()
    assert any(
        "128 of 256 faces are selected" in warning.words for warning in answer.report.warnings
    )


@pytest.mark.parametrize(
    "cones",
    [{"tolerance_band": {"relative": 0.001}}, {"edge_cap": {"length": {"relative": 0.5}}}],
    ids=["tolerance_band", "edge_cap"],
)
def test_nothing_is_asked_of_what_is_not_selected(cones: dict[str, object]):
    source = MeshFile("rough.glb", two_balls().glb())
    selected = {"instances": "split", "select": {"nodes": ["two"]}}

    answer = refine(source, smooth_pair(), parse_options({**FAST, **selected, "cones": cones}))

    assert answer.report.outcome == "improved"


def test_a_selection_needs_the_surface_formulation():
    source = MeshFile("rough.glb", two_balls().glb())
    options = {"formulation": "centroid", "instances": "split", "select": {"nodes": ["two"]}}
    with pytest.raises(InputError, match="surface formulation"):
        refine(source, smooth_pair(), parse_options(options))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b"v ", b"v 90 ", "has a vertex .* radii from where it was to be"),
        (b"v ", b"v x", "cannot be read back: .*'x"),
    ],
    ids=["other numbers", "no numbers"],
)
def test_a_writer_that_damages_a_file_is_ours_to_blame(
    monkeypatch: pytest.MonkeyPatch, old: bytes, new: bytes, words: str
) -> None:
    patched = ObjAsset.patched

    def damaged(asset: ObjAsset, *given: Any) -> bytes:
        return patched(asset, *given).replace(old, new, 1)

    monkeypatch.setattr(ObjAsset, "patched", damaged)
    with pytest.raises(InternalError, match=words) as caught:
        refine(rough(), smooth(), parse_options(FAST))
    assert caught.value.file == "rough.refined.obj"
