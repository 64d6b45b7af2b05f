"""What is selected may move; everything else stays, byte for byte."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import Asset, read_asset
from meshcone.errors import InputError
from meshcone.options import parse_options
from tests.unit.assets.builders import Gltf, chunks, cube_gltf, split_cube

OBJ = b"""o box
g left
usemtl red
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 2 1 0
f 1 2 3 4
g right far
usemtl blue
f 2 5 6 3
o lone
v 5 0 0
v 6 0 0
v 5 1 0
f 7 8 9
"""


def selection(asset: Asset, **select) -> list[bool]:
    selected = asset.policy(parse_options({"select": select})).selected
    assert selected is not None
    return selected.tolist()


def refusal(asset: Asset, **select) -> str:
    with pytest.raises(InputError) as caught:
        asset.policy(parse_options({"select": select}))
    return caught.value.message


def scene() -> Gltf:
    """Two cubes with a mesh and material each; the second below a node of its own."""
    gltf = cube_gltf(name="Left")
    positions, normals, triangles = split_cube()
    attributes = {"POSITION": gltf.accessor(positions), "NORMAL": gltf.accessor(normals)}
    primitive = {"attributes": attributes, "indices": gltf.accessor(triangles.reshape(-1))}
    mesh = gltf.mesh(primitive | {"material": 1}, name="Wheel rim")
    child = gltf.node(root=False, mesh=mesh, name="Rim", translation=[3, 0, 0])
    gltf.node(children=[child], name="Axle")
    gltf.json["materials"] = [{"name": "paint"}, {"name": "steel [brushed]"}]
    gltf.json["meshes"][0]["primitives"][0]["material"] = 0
    return gltf


FIRST, SECOND = [True] * 12 + [False] * 12, [False] * 12 + [True] * 12


@pytest.mark.parametrize(
    ("select", "expected"),
    [
        ({"nodes": ["Left"]}, FIRST),
        ({"nodes": ["Axle"]}, SECOND),
        ({"nodes": [1]}, SECOND),
        ({"nodes": ["L*", "R?m"]}, [True] * 24),
        ({"meshes": ["Wheel*"]}, SECOND),
        ({"meshes": [0]}, FIRST),
        ({"materials": ["steel [brushed]"]}, SECOND),
        ({"materials": ["paint", 1], "nodes": ["Left"]}, FIRST),
    ],
)
def test_faces_of_a_gltf_are_selected_by_name_pattern_and_index(select, expected):
    assert selection(read_asset("mesh.glb", scene().glb()), **select) == expected


@pytest.mark.parametrize(
    ("select", "expected"),
    [
        ({"materials": ["blue"]}, [False, False, True, True, True]),
        ({"materials": ["r*"]}, [True, True, False, False, False]),
        ({"groups": ["far"]}, [False, False, True, True, True]),
        ({"groups": ["far"], "meshes": ["box"]}, [False, False, True, True, False]),
        ({"meshes": [1]}, [False, False, False, False, True]),
    ],
)
def test_faces_of_an_obj_are_selected_by_object_group_and_material(select, expected):
    assert selection(read_asset("mesh.obj", OBJ), **select) == expected


def test_a_name_that_is_not_there_is_told_with_those_that_are():
    asset = read_asset("mesh.glb", scene().glb())
    message = refusal(asset, materials=["stele"])
    assert "option 'select.materials': nothing that is drawn has 'stele'" in message
    assert "'paint', 'steel [brushed]'" in message
    assert "index 7" in refusal(asset, meshes=[7])


def test_a_division_the_format_has_not_is_refused():
    assert "select.nodes" in refusal(read_asset("mesh.obj", OBJ), nodes=["box"])
    assert "select.groups" in refusal(read_asset("mesh.glb", scene().glb()), groups=["a"])


def test_lists_without_a_common_face_are_refused():
    asset = read_asset("mesh.glb", scene().glb())
    assert "no face is in all" in refusal(asset, nodes=["Left"], materials=["steel*"])


def test_parts_that_share_every_vertex_with_others_are_refused():
    gltf = cube_gltf()
    primitive = gltf.json["meshes"][0]["primitives"][0]
    gltf.json["materials"] = [{"name": "a"}, {"name": "b"}]
    gltf.json["meshes"][0]["primitives"] = [primitive | {"material": n} for n in range(2)]
    assert "nothing can move" in refusal(read_asset("mesh.glb", gltf.glb()), materials=["a"])


def test_what_is_not_selected_keeps_its_bytes():
    gltf = scene()
    asset = read_asset("mesh.glb", gltf.glb())
    policy = asset.policy(parse_options({"select": {"nodes": ["Axle"]}}))
    document, binary = chunks(asset.patched(asset.vertices * 1.5, policy))
    before, old_binary = chunks(gltf.glb())
    start = before["bufferViews"][4]["byteOffset"]
    assert binary[:start] == old_binary[:start]
    assert binary[start:] != old_binary[start:]
    assert document["accessors"][:4] == before["accessors"][:4]


def test_a_border_between_parts_stays_so_that_no_crack_opens():
    asset = read_asset("mesh.obj", OBJ)
    policy = asset.policy(parse_options({"select": {"groups": ["left"]}}))
    after = read_asset("mesh.obj", asset.patched(asset.vertices + 0.25, policy))
    moved = (after.positions != asset.positions).any(axis=1)
    assert moved.tolist() == [True, False, False, True, *[False] * 5]


def test_lines_of_an_obj_outside_the_selection_stay():
    asset = read_asset("mesh.obj", OBJ)
    policy = asset.policy(parse_options({"select": {"meshes": ["lone"]}}))
    before, after = OBJ.splitlines(), asset.patched(asset.vertices + 1, policy).splitlines()
    assert [a == b for a, b in zip(after, before, strict=True)].count(False) == 3


def test_normals_that_other_parts_use_stay():
    lines = OBJ.replace(b"f 1 2 3 4", b"vn 0 0 1\nvn 0 0 1\nf 1//1 2//2 3//2 4//1")
    asset = read_asset("mesh.obj", lines.replace(b"f 2 5 6 3", b"f 2//2 5//2 6//2 3//2"))
    policy = asset.policy(parse_options({"select": {"groups": ["left"]}}))
    raised = asset.vertices + np.array([0, 0, 1])
    normals = [line for line in asset.patched(raised, policy).splitlines() if line[:2] == b"vn"]
    assert normals[0] != b"vn 0 0 1"
    assert normals[1] == b"vn 0 0 1"


def test_an_instance_that_is_not_selected_is_no_obstacle():
    gltf = scene()
    gltf.node(mesh=0, translation=[9, 0, 0])
    asset = read_asset("mesh.glb", gltf.glb())
    asset.ensure_writable(asset.policy(parse_options({"select": {"nodes": ["Axle"]}})))
    with pytest.raises(InputError, match="instances=split"):
        asset.ensure_writable(asset.policy(parse_options({"instances": "refuse"})))
