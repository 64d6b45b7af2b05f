from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import Asset, read_asset
from tests.unit.assets.builders import Gltf, cube_obj, split_cube

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


def obj(faces: str) -> Asset:
    return read_asset("mesh.obj", (CORNERS + faces).encode())


def two_primitives(*materials: int | None, **root: object) -> Asset:
    gltf = Gltf()
    positions, _, triangles = split_cube()
    position = gltf.accessor(positions)
    primitives = []
    for half, material in zip(np.split(triangles, 2), materials, strict=True):
        indices = gltf.accessor(half.reshape(-1))
        primitive = {"attributes": {"POSITION": position}, "indices": indices}
        primitives.append(primitive | ({} if material is None else {"material": material}))
    gltf.node(mesh=gltf.mesh(*primitives), name="cube")
    gltf.json |= root
    return read_asset("mesh.glb", gltf.glb())


def test_materials_divide_an_obj() -> None:
    asset = read_asset("cube.obj", cube_obj())

    assert asset.regions.tolist() == [0] * 6 + [1] * 6
    assert asset.region_names == ("cube / material 0", "cube / material 1")


def test_a_group_and_a_material_together_make_a_region() -> None:
    asset = obj("g a\nusemtl x\nf 1 2 3\ng b\nf 1 2 4\nusemtl y\nf 1 3 4\ng a\nusemtl x\nf 2 3 4\n")

    assert asset.regions.tolist() == [0, 1, 2, 0]
    assert asset.region_names == ("a / x", "b / x", "b / y")


def test_faces_before_the_first_material_are_a_region_without_a_name() -> None:
    asset = obj("f 1 2 3\nusemtl x\nf 1 2 4\n")

    assert asset.regions.tolist() == [0, 1]
    assert asset.region_names == ("", "x")


def test_regions_follow_the_faces_that_are_kept() -> None:
    asset = obj("usemtl x\nf 1 1 2\nf 1 2 3\nusemtl y\nf 1 2\nf 1 2 4 3\n")

    assert asset.regions.tolist() == [0, 1, 1]


def test_primitives_with_different_materials_differ() -> None:
    asset = two_primitives(0, 1, materials=[{"name": "steel"}, {}])

    assert asset.regions.tolist() == [0] * 6 + [1] * 6
    assert asset.region_names == ("cube / steel", "cube / material 1")


@pytest.mark.parametrize("material", [None, 0])
def test_primitives_with_the_same_material_agree(material: int | None) -> None:
    assert set(two_primitives(material, material, materials=[{}]).regions.tolist()) == {0}


def test_the_same_mesh_at_two_nodes_is_two_regions() -> None:
    gltf = Gltf()
    positions, _, triangles = split_cube()
    attributes = {"POSITION": gltf.accessor(positions)}
    indices = gltf.accessor(triangles.reshape(-1))
    mesh = gltf.mesh({"attributes": attributes, "indices": indices})
    gltf.node(mesh=mesh, name="wheel")
    gltf.node(mesh=mesh, name="wheel", translation=[3, 0, 0])

    assert read_asset("mesh.glb", gltf.glb()).regions.tolist() == [0] * 12 + [1] * 12


def test_formats_without_parts_have_one_region() -> None:
    asset = read_asset("mesh.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")

    assert (asset.regions.tolist(), asset.region_names) == ([0], ("",))
