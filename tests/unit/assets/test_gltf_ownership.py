from __future__ import annotations

import pytest

from meshcone.assets import read_asset
from meshcone.errors import InputError
from tests.unit.assets.builders import cube_gltf


def read(data: bytes):
    return read_asset("mesh.glb", data)


def shared(change) -> InputError:
    gltf = cube_gltf()
    change(gltf)
    asset = read(gltf.glb())
    with pytest.raises(InputError) as caught:
        asset.ensure_writable()
    with pytest.raises(InputError):
        asset.patched(asset.vertices + 1)
    assert caught.value.file == "mesh.glb"
    return caught.value


def test_an_instanced_mesh_is_refused_by_name():
    error = shared(lambda gltf: gltf.node(mesh=0, translation=[5, 0, 0]))
    assert "mesh 'Cube' is used by nodes 0, 1" in error.message


def test_positions_of_two_meshes_are_refused():
    def change(gltf):
        gltf.node(mesh=gltf.mesh(*gltf.json["meshes"][0]["primitives"]), translation=[5, 0, 0])

    assert "accessor 0 holds the positions of meshes 0, 1" in shared(change).message


def test_a_flattening_node_is_refused():
    error = shared(lambda gltf: gltf.json["nodes"][0].update(scale=[1, 1, 0]))
    assert "node 0 flattens its mesh" in error.message


def test_shared_bytes_are_refused():
    def change(gltf):
        overlapping = gltf.json["accessors"][0] | {"count": 2, "byteOffset": 12}
        gltf.json["accessors"].append(overlapping)

    assert shared(change).place == "/accessors/4"


def test_a_morph_target_that_is_the_mesh_itself_is_refused():
    def change(gltf):
        gltf.json["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 0}]

    assert "reads accessor 0" in shared(change).message


def test_positions_declared_once_per_primitive_are_no_conflict():
    gltf = cube_gltf()
    primitive = gltf.json["meshes"][0]["primitives"][0]
    gltf.json["accessors"].append(dict(gltf.json["accessors"][0]))
    attributes = {"POSITION": 4}
    gltf.json["meshes"][0]["primitives"].append(primitive | {"attributes": attributes})
    asset = read(gltf.glb())
    again = read(asset.patched(asset.vertices + 1))
    assert again.vertices == pytest.approx(asset.vertices + 1)
