"""Vertex data that serves as something else too: that stays, and what should move along does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from meshcone.assets import Asset, WritePolicy, read_asset
from meshcone.errors import InputError
from tests.unit.assets.builders import CUBE, Gltf, chunks, cube_gltf
from tests.unit.assets.dividing import divided, square
from tests.unit.assets.plain_gltf import table

AUTO = WritePolicy(instances="auto")
INSTANCING = "EXT_mesh_gpu_instancing"
MANIFOLD = "EXT_mesh_manifold"
LIFT = np.array([0, 0, 0.5])


def read(gltf: Gltf) -> Asset:
    return read_asset("mesh.glb", gltf.glb())


def with_instances_at_corners() -> Gltf:
    """Something above each corner of a square: its places are the square's positions."""
    gltf = square()
    corners = gltf.accessor((CUBE / 8 + 0.25).astype(np.float32))
    mesh = gltf.mesh({"attributes": {"POSITION": corners}, "indices": 1})
    places = {"TRANSLATION": gltf.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"]}
    gltf.node(mesh=mesh, extensions={INSTANCING: {"attributes": places}})
    gltf.json["extensionsUsed"] = [INSTANCING]
    return gltf


def with_animated_places() -> Gltf:
    """A square, and a node that moves from one of its corners to the next."""
    gltf = square()
    times = gltf.accessor(np.arange(4, dtype=np.float32))
    channel = {"sampler": 0, "target": {"node": gltf.node(), "path": "translation"}}
    samplers = [{"input": times, "output": 0}]
    gltf.json["animations"] = [{"samplers": samplers, "channels": [channel]}]
    return gltf


@pytest.mark.parametrize("make", [with_instances_at_corners, with_animated_places])
def test_what_else_reads_positions_is_refused_where_nothing_may_be_split(
    make: Callable[[], Gltf],
) -> None:
    asset = read(make())
    only_square = np.arange(len(asset.faces)) < 2
    policy = WritePolicy(selected=only_square, instances="refuse")
    with pytest.raises(InputError, match=r"reads accessor 0, .*set instances=split"):
        asset.ensure_writable(policy)


@pytest.mark.parametrize("make", [with_instances_at_corners, with_animated_places])
def test_what_else_reads_positions_keeps_them(make: Callable[[], Gltf]) -> None:
    asset = read(make())
    only_square = np.arange(len(asset.faces)) < 2

    written = asset.patched(
        asset.vertices + LIFT, WritePolicy(selected=only_square, instances="auto")
    )

    after = read_asset("mesh.glb", written)
    assert after.vertices[:4] == pytest.approx(asset.vertices[:4] + LIFT)
    assert after.vertices[4:].tolist() == asset.vertices[4:].tolist()
    assert table(written, 0).tolist() == table(make().glb(), 0).tolist()


def manifold(gltf: Gltf, **members: Any) -> Gltf:
    """Let an extension say that the first mesh is what its first primitive is."""
    mesh = gltf.json["meshes"][0]
    drawn = mesh["primitives"][0]
    position = drawn["attributes"]["POSITION"]
    whole = {"attributes": {"POSITION": position}, "indices": drawn["indices"]} | members
    mesh["extensions"] = {MANIFOLD: {"manifoldPrimitive": whole}}
    gltf.json["extensionsUsed"] = [MANIFOLD]
    return gltf


def test_what_is_the_whole_of_a_mesh_has_the_positions_of_each_copy() -> None:
    gltf = manifold(cube_gltf())
    gltf.node(mesh=0, translation=[5, 0, 0])
    asset = read(gltf)
    drift = np.random.default_rng(3).uniform(-0.1, 0.1, asset.vertices.shape)

    document, _ = chunks(asset.patched(asset.vertices + drift, AUTO))

    drawn = [mesh["primitives"][0]["attributes"]["POSITION"] for mesh in document["meshes"]]
    whole = [mesh["extensions"][MANIFOLD]["manifoldPrimitive"] for mesh in document["meshes"]]
    assert len(set(drawn)) == 2
    assert [each["attributes"]["POSITION"] for each in whole] == drawn


def test_what_is_the_whole_of_a_mesh_follows_positions_that_are_stored_apart() -> None:
    gltf = manifold(cube_gltf())
    gltf.node(mesh=gltf.mesh(*gltf.json["meshes"][0]["primitives"]), translation=[5, 0, 0])
    asset = read(gltf)
    drift = np.random.default_rng(3).uniform(-0.1, 0.1, asset.vertices.shape)

    document, _ = chunks(asset.patched(asset.vertices + drift, AUTO))

    mesh = document["meshes"][0]
    whole = mesh["extensions"][MANIFOLD]["manifoldPrimitive"]
    assert whole["attributes"]["POSITION"] == mesh["primitives"][0]["attributes"]["POSITION"]


def test_what_is_the_whole_of_a_mesh_needs_the_positions_of_that_mesh() -> None:
    gltf = cube_gltf()
    other = gltf.accessor(np.zeros((24, 3), dtype=np.float32))
    asset = read(manifold(gltf, attributes={"POSITION": other}))
    with pytest.raises(InputError, match=r"EXT_mesh_manifold.* positions of mesh 'Cube'"):
        asset.ensure_writable(AUTO)


@pytest.mark.parametrize("name", [MANIFOLD, "VENDOR_of_its_own"])
def test_a_mesh_of_which_an_extension_speaks_is_not_divided(name: str) -> None:
    gltf = manifold(square())
    mesh = gltf.json["meshes"][0]
    mesh["extensions"] = {name: mesh["extensions"][MANIFOLD]}
    with pytest.raises(InputError, match=f"'{name}' may speak of vertices") as refused:
        divided(gltf.glb(), [0, 1])
    assert refused.value.place == "/meshes/0/extensions"


def test_a_mesh_whose_author_an_extension_names_is_divided() -> None:
    gltf = square()
    gltf.json["meshes"][0]["extensions"] = {"KHR_xmp_json_ld": {"packet": 0}}
    after, _ = divided(gltf.glb(), [0, 1])
    assert len(read_asset("a.glb", after).faces) > 2
