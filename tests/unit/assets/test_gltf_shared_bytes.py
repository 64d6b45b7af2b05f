"""What shares bytes with vertices that move keeps what it reads; the vertices get bytes apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshcone.assets import Asset, WritePolicy, read_asset
from meshcone.errors import InputError
from tests.unit.assets.builders import Gltf, chunks, cube_gltf, split_cube
from tests.unit.assets.plain_gltf import table

SPLIT = WritePolicy(instances="split")


def moved(gltf: Gltf) -> tuple[Asset, bytes]:
    """The file as it is read, and as it is written with every vertex somewhere else."""
    asset = read_asset("mesh.glb", gltf.glb())
    drift = np.random.default_rng(3).uniform(-0.1, 0.1, asset.vertices.shape)
    data = asset.patched(asset.vertices + drift, SPLIT)
    after = read_asset("mesh.glb", data)
    used = asset.weld >= 0
    wanted = (asset.vertices + drift)[asset.weld[used]]
    assert after.positions[used] == pytest.approx(wanted, abs=1e-6)
    return asset, data


def window(gltf: Gltf, accessor: int, first: int, count: int, **members: Any) -> int:
    """Another accessor over some elements of one that is stored densely."""
    of = gltf.json["accessors"][accessor]
    size = 12
    declared = of | {"byteOffset": of["byteOffset"] + first * size, "count": count} | members
    gltf.json["accessors"].append(declared)
    return len(gltf.json["accessors"]) - 1


def test_an_accessor_that_nothing_uses_keeps_its_values() -> None:
    gltf = cube_gltf()
    other = window(gltf, 0, first=1, count=2)
    _, data = moved(gltf)
    assert table(data, other).tolist() == table(gltf.glb(), other).tolist()


def test_colours_made_of_positions_keep_their_values() -> None:
    gltf = cube_gltf()
    primitive = gltf.json["meshes"][0]["primitives"][0]
    primitive["attributes"]["COLOR_0"] = window(gltf, 0, first=0, count=24)
    _, data = moved(gltf)
    attributes = chunks(data)[0]["meshes"][0]["primitives"][0]["attributes"]
    before = table(gltf.glb(), primitive["attributes"]["COLOR_0"])
    assert table(data, attributes["COLOR_0"]).tolist() == before.tolist()


def test_colours_that_are_the_positions_keep_their_accessor() -> None:
    gltf = cube_gltf()
    primitive = gltf.json["meshes"][0]["primitives"][0]
    primitive["attributes"]["COLOR_0"] = 0
    _, data = moved(gltf)
    attributes = chunks(data)[0]["meshes"][0]["primitives"][0]["attributes"]
    assert (attributes["POSITION"], attributes["COLOR_0"]) == (4, 0)
    assert table(data, 0).tolist() == table(gltf.glb(), 0).tolist()


def test_normals_that_are_the_positions_get_bytes_of_their_own() -> None:
    gltf = cube_gltf()
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 0
    _, data = moved(gltf)
    attributes = chunks(data)[0]["meshes"][0]["primitives"][0]["attributes"]
    assert attributes["NORMAL"] != attributes["POSITION"]


def test_an_image_within_the_bytes_of_positions_stays() -> None:
    gltf = cube_gltf()
    gltf.json["images"] = [{"bufferView": 0, "mimeType": "image/png"}]
    _, data = moved(gltf)
    document, binary = chunks(data)
    view = document["bufferViews"][document["images"][0]["bufferView"]]
    start = view["byteOffset"]
    assert binary[start : start + 24 * 12] == gltf.binary[: 24 * 12]


def test_an_accessor_that_gets_bytes_of_its_own_keeps_its_number() -> None:
    gltf = cube_gltf()
    window(gltf, 0, first=1, count=2)
    _, data = moved(gltf)
    document, _ = chunks(data)
    assert len(document["accessors"]) == len(gltf.json["accessors"])
    assert document["meshes"] == gltf.json["meshes"]


def test_the_report_can_say_that_bytes_were_shared() -> None:
    gltf = cube_gltf()
    window(gltf, 0, first=1, count=2)
    asset, data = moved(gltf)
    (notice,) = asset.changes(SPLIT, read_asset("mesh.glb", data))
    assert "stored apart" in notice.words


def test_where_nothing_may_be_split_shared_bytes_are_refused_with_what_helps() -> None:
    gltf = cube_gltf()
    gltf.json["images"] = [{"bufferView": 0, "mimeType": "image/png"}]
    asset = read_asset("mesh.glb", gltf.glb())
    with pytest.raises(InputError, match="instances=split") as caught:
        asset.ensure_writable()
    assert caught.value.place == "/images/0"


def test_what_reaches_past_its_buffer_is_in_nobodys_way() -> None:
    gltf = cube_gltf()
    window(gltf, 0, first=1, count=2)
    view = {"buffer": 0, "byteOffset": len(gltf.binary), "byteLength": 600}
    gltf.json["bufferViews"].append(view)
    beyond = window(gltf, 0, first=0, count=24, bufferView=len(gltf.json["bufferViews"]) - 1)
    gltf.json["images"] = [{"bufferView": len(gltf.json["bufferViews"]) - 1}]
    _, data = moved(gltf)
    document, binary = chunks(data)
    assert document["accessors"][beyond] == gltf.json["accessors"][beyond]
    assert len(binary) == len(gltf.binary)  # it would read what is appended
    assert len(document["buffers"]) == 2


def test_rows_of_sparse_accessors_may_be_the_same_bytes() -> None:
    gltf = cube_gltf()
    rows = gltf.view(b"\2\0\5\0")
    for accessor in (0, 1):
        values = table(gltf.glb(), accessor)[[2, 5]]
        gltf.json["accessors"][accessor]["sparse"] = {
            "count": 2,
            "indices": {"bufferView": rows, "componentType": 5123},
            "values": {"bufferView": gltf.view(values.tobytes())},
        }
    _, data = moved(gltf)
    document, binary = chunks(data)
    assert len(binary) == len(gltf.binary)
    assert document["accessors"][0]["sparse"] == gltf.json["accessors"][0]["sparse"]


def test_sparse_positions_over_those_of_another_mesh_are_stored_in_full() -> None:
    gltf = cube_gltf()
    [primitive] = gltf.json["meshes"][0]["primitives"]
    changed = table(gltf.glb(), 0)[[2]] + np.float32(0.5)
    sparse = {
        "count": 1,
        "indices": {"bufferView": gltf.view(b"\2\0"), "componentType": 5123},
        "values": {"bufferView": gltf.view(changed.tobytes())},
    }
    other = window(gltf, 0, first=0, count=24, sparse=sparse, max=[1, 1.5, 1])
    gltf.node(
        mesh=gltf.mesh(primitive | {"attributes": {"POSITION": other}}), translation=[5, 0, 0]
    )
    _, data = moved(gltf)
    assert "sparse" not in chunks(data)[0]["accessors"][other]


def test_the_same_positions_under_other_joints_are_copied() -> None:
    gltf = cube_gltf()
    weights = gltf.accessor(np.tile(np.float32([1, 0, 0, 0]), (24, 1)))
    joints = [gltf.accessor(np.full((24, 4), each, "u1")) for each in (0, 1)]
    [primitive] = gltf.json["meshes"][0]["primitives"]
    gltf.json["meshes"][0]["primitives"] = [
        primitive | {"attributes": {"POSITION": 0, "JOINTS_0": each, "WEIGHTS_0": weights}}
        for each in joints
    ]
    gltf.json["skins"] = [{"joints": [gltf.node(), gltf.node(translation=[5, 0, 0])]}]
    gltf.json["nodes"][0]["skin"] = 0
    asset, data = moved(gltf)
    assert len(asset.vertices) == 16
    primitives = chunks(data)[0]["meshes"][0]["primitives"]
    assert [each["attributes"]["POSITION"] for each in primitives] == [0, 7]


def test_the_same_bytes_as_other_numbers_are_copied() -> None:
    gltf = Gltf()
    positions, _, triangles = split_cube()
    rows = np.zeros((24, 4), "i2")
    rows[:, :3] = positions * 1000
    view = gltf.view(rows.tobytes(), stride=8)
    indices = gltf.accessor(triangles.reshape(-1))
    primitives = [
        {
            "attributes": {"POSITION": gltf.accessor(rows[:, :3], view, normalized=normalized)},
            "indices": indices,
        }
        for normalized in (False, True)
    ]
    gltf.node(mesh=gltf.mesh(*primitives))
    gltf.json["extensionsUsed"] = gltf.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    asset = read_asset("mesh.glb", gltf.glb())
    target = asset.vertices * 1.5
    after = read_asset("mesh.glb", asset.patched(target, SPLIT))
    assert after.positions == pytest.approx(target[asset.weld], abs=1)


@given(st.data())
def test_overlapping_runs_of_one_buffer_come_apart_as_far_as_they_move_apart(
    drawn: st.DataObject,
) -> None:
    gltf = Gltf()
    positions, normals, _ = split_cube()
    stride = drawn.draw(st.sampled_from([12, 24, 40]))
    store = np.zeros((24, stride), "u1")
    store[:, :12] = positions.view("u1").reshape(24, 12)
    if stride > 12:
        store[:, 12:24] = normals.view("u1").reshape(24, 12)
    view = gltf.view(store.tobytes(), stride=stride)

    def run(offset: int) -> int:
        count = drawn.draw(st.integers(3, 24))
        start = stride * drawn.draw(st.integers(0, 24 - count)) + offset
        declared = {"bufferView": view, "byteOffset": start, "componentType": 5126}
        gltf.json["accessors"].append(declared | {"count": count, "type": "VEC3"})
        return len(gltf.json["accessors"]) - 1

    modes = st.lists(st.sampled_from([4, 5, 6]), min_size=1, max_size=3)
    for number in range(drawn.draw(st.integers(1, 2))):
        primitives = [
            {"attributes": {"POSITION": run(0)}, "mode": mode} for mode in drawn.draw(modes)
        ]
        gltf.node(mesh=gltf.mesh(*primitives), translation=[3 * number, 0, 0])
    offsets = st.sampled_from([0] if stride == 12 else [0, 12])
    others = [run(drawn.draw(offsets)) for _ in range(3)]
    gltf.mesh({"attributes": {"POSITION": others[0]}, "mode": 1})

    _, data = moved(gltf)

    for index in others:
        assert table(data, index).tolist() == table(gltf.glb(), index).tolist()


def test_every_accessor_over_what_moved_says_how_far_it_reaches() -> None:
    gltf = cube_gltf()
    first = gltf.json["meshes"][0]["primitives"][0]
    again = window(gltf, 0, first=0, count=24)
    lower = gltf.accessor(np.array([0, 1, 2, 0, 2, 3], dtype=np.uint16))
    gltf.json["meshes"][0]["primitives"] = [
        first,
        {"attributes": {"POSITION": again}, "indices": lower},
    ]
    asset = read_asset("mesh.glb", gltf.glb())
    upper = asset.vertices[:, 2] > 0.5

    data = asset.patched(asset.vertices + np.where(upper[:, None], [0, 0, 1], 0.0), SPLIT)

    accessors = chunks(data)[0]["accessors"]
    assert table(data, again)[:, 2].max() == 2
    assert accessors[again]["max"] == accessors[0]["max"] == [1, 1, 2]


def test_hundreds_of_primitives_may_each_declare_one_run_of_vertices() -> None:
    gltf = Gltf()
    rows = np.array([[0, 0, 0, 0, 0], [1, 0, 0, 1, 0], [0, 1, 0, 0, 1]], dtype=np.float32)
    run = gltf.view(rows.tobytes(), stride=20)
    gltf.mesh(
        *(
            {
                "attributes": {
                    "POSITION": gltf.accessor(rows[:, :3], run),
                    "TEXCOORD_0": gltf.accessor(rows[:, 3:], run, offset=12),
                }
            }
            for _ in range(400)
        )
    )
    gltf.node(mesh=0)
    for policy in (SPLIT, WritePolicy(instances="refuse")):
        read_asset("mesh.glb", gltf.glb()).ensure_writable(policy)


def test_a_table_of_properties_within_the_bytes_of_positions_stays() -> None:
    gltf = cube_gltf()
    values = dict(gltf.json["bufferViews"][0]) | {"byteLength": 24}
    gltf.json["bufferViews"].append(values)
    table_view = len(gltf.json["bufferViews"]) - 1
    properties = {"count": 6, "properties": {"height": {"values": table_view}}}
    gltf.json["extensions"] = {"EXT_structural_metadata": {"propertyTables": [properties]}}
    with pytest.raises(InputError, match="shares bytes") as refused:
        read_asset("mesh.glb", gltf.glb()).ensure_writable(WritePolicy(instances="refuse"))
    assert refused.value.place == f"/bufferViews/{table_view}"

    _, data = moved(gltf)

    document, binary = chunks(data)
    assert document["extensions"] == gltf.json["extensions"]
    assert document["bufferViews"][table_view] == values
    assert binary[:24] == gltf.binary[:24]
