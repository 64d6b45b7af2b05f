"""What is told of two files that differ in more than their surface."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.auditing.changes import changes_between
from meshcone.auditing.records.changes import ROWS_KEPT
from tests.unit.auditing.damaged import Damage, after, asset_of, counted
from tests.unit.auditing.squares import one_square
from tests.whole_asset import Document, png, whole


def another_image(document: dict[str, Any]) -> None:
    uri = "data:image/png;base64," + base64.b64encode(png((255, 0, 255))).decode()
    document["images"][0] = {"uri": uri}


def without(array: str, *users: tuple[str | int, ...]) -> Damage:
    def damage(document: dict[str, Any]) -> None:
        del document[array]
        for *path, last in users:
            holder: Any = document
            for key in path:
                holder = holder[key]
            del holder[last]

    return damage


def attributes(document: dict[str, Any], primitive: int) -> dict[str, int]:
    found: dict[str, int] = document["meshes"][0]["primitives"][primitive]["attributes"]
    return found


@pytest.mark.parametrize(
    ("damage", "found"),
    [
        (lambda d: [attributes(d, n).pop("TEXCOORD_0") for n in (0, 1)], {"lost.uv_sets": 1}),
        (lambda d: [attributes(d, n).pop("NORMAL") for n in (0, 1)], {"lost.attributes": 1}),
        (
            lambda d: d["materials"][0].update(name="other"),
            {
                "renamed.materials": 1,
                "altered.meshes": 1,
            },
        ),
        (lambda d: d["materials"][1].update(alphaMode="MASK"), {"altered.materials": 1}),
        (
            lambda d: d["materials"][0]["pbrMetallicRoughness"].update(roughnessFactor=0.5),
            {"altered.materials": 1},
        ),
        (
            lambda d: d["materials"][0]["pbrMetallicRoughness"].pop("baseColorTexture"),
            {"altered.materials": 1},
        ),
        (another_image, {"lost.images": 1, "added.images": 1, "altered.materials": 1}),
        (without("animations"), {"lost.animations": 1}),
        (lambda d: d["animations"][0].update(name="sway"), {"renamed.animations": 1}),
        (lambda d: d["animations"][0]["channels"].pop(), {"altered.animations": 3}),
        (without("skins"), {"lost.skins": 1}),
        (
            lambda d: d["materials"][1]["extensions"]["KHR_materials_ior"].update(ior=1.1),
            {"altered.materials": 1},
        ),
        (lambda d: d["samplers"][0].update(magFilter=9729), {"altered.materials": 1}),
        (lambda d: d["nodes"][0].update(translation=[0, 2, 0]), {"moved.nodes": 1}),
        (
            lambda d: (d["nodes"][0].update(children=[2]), d["scenes"][0]["nodes"].append(1)),
            {"lost.nodes": 1, "added.nodes": 1},
        ),
        (lambda d: d["nodes"][2].pop("extras"), {"lost.extras": 1}),
        (lambda d: d["nodes"][2].update(extras={"kind": "x"}), {"altered.extras": 1}),
        (lambda d: d["scenes"][0].update(name="hall"), {"lost.scenes": 1, "added.scenes": 1}),
        (lambda d: d.update(extensionsUsed=[]), {"lost.extensions": 1}),
        (lambda d: d.update(cameras=[{"name": "front"}]), {"added.cameras": 1}),
        (
            lambda d: d["meshes"][0]["primitives"][0].update(targets=[{"POSITION": 0}]),
            {"added.morph_targets": 1},
        ),
        (lambda d: d["meshes"][0]["primitives"][0].update(material=1), {"altered.meshes": 1}),
    ],
)
def test_each_damage_is_counted_as_what_it_is(damage: Damage, found: dict[str, int]) -> None:
    assert counted(after(damage)) == found


def test_nothing_changed_in_a_copy() -> None:
    changes = after(lambda document: document)

    assert counted(changes) == {}
    assert changes.rows == ()


def test_another_order_and_another_spelling_are_no_change() -> None:
    document = whole()
    document.json["materials"].reverse()
    for primitive, material in zip(document.json["meshes"][0]["primitives"], (1, 0), strict=True):
        primitive["material"] = material
    spelled = json.loads(json.dumps(document.json))
    spelled["nodes"][0] = {
        "name": "root",
        "children": [2, 1],
        "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 0, 1],
    }
    document.json = spelled

    assert counted(changes_between(asset_of(whole()), asset_of(document))) == {}


def quantised(document: Document) -> None:
    """Store positions in 16 bits, as exporters do, and have the node's matrix undo it."""
    node = document.json["nodes"][1]
    for primitive, first in zip(document.json["meshes"][0]["primitives"], (0, 3), strict=True):
        square = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]) + np.array([first, 0, 0])
        stored = np.rint(square / 5 * 65535).astype("<u2")
        padded = np.column_stack([stored, np.zeros(4, dtype="<u2")])  # rows of 8 bytes
        accessor = document.accessor(padded.astype("<u2"), type="VEC3", normalized=True)
        document.json["bufferViews"][-1]["byteStride"] = 8
        primitive["attributes"]["POSITION"] = accessor
    node["scale"] = [5, 5, 5]
    document.json["extensionsUsed"].append("KHR_mesh_quantization")
    document.json["extensionsRequired"] = ["KHR_mesh_quantization"]


def test_positions_in_other_units_are_no_move() -> None:
    document = whole()
    quantised(document)

    assert counted(changes_between(asset_of(whole()), asset_of(document))) == {
        "added.extensions": 1
    }


@pytest.mark.parametrize("placed", [{"scale": [1.01, 1.01, 1.01]}, {"translation": [0.01, 0, 0]}])
def test_a_node_whose_surface_is_elsewhere_has_moved(placed: dict[str, list[float]]) -> None:
    assert counted(after(lambda d: d["nodes"][1].update(placed))) == {"moved.nodes": 1}


def test_a_node_has_moved_that_undoes_other_units_wrongly() -> None:
    document = whole()
    quantised(document)
    document.json["nodes"][1]["scale"] = [5.1, 5, 5]

    changes = changes_between(asset_of(whole()), asset_of(document))

    assert changes.moved.nodes == 1


def test_a_node_that_draws_nothing_has_moved_where_its_scale_is_another() -> None:
    document = whole()
    document.json["nodes"][2]["scale"] = [2, 2, 2]

    assert counted(changes_between(asset_of(whole()), asset_of(document))) == {"moved.nodes": 1}


def test_a_change_is_told_in_words_with_both_sides() -> None:
    [row] = after(lambda d: d["nodes"][0].update(translation=[0, 2, 0])).rows

    assert (row.where, row.words) == ("root", "node 'root' is placed otherwise")
    assert row.reference == "at (0, 1, 0), scaled 1 by 1 by 1"
    assert row.source == "at (0, 2, 0), scaled 1 by 1 by 1"


def test_other_materials_are_told_beside_those_of_the_reference() -> None:
    [row] = after(lambda d: d["meshes"][0]["primitives"][0].update(material=1)).rows[:1]

    assert row.words == (
        "mesh 'squares' differs in materials: glass; the reference has glass, painted"
    )


def test_two_things_of_one_name_are_two_things() -> None:
    document = whole()
    document.json["materials"].append({"name": "glass"})

    assert counted(changes_between(asset_of(whole()), asset_of(document))) == {"added.materials": 1}


def test_more_changes_than_are_listed_are_counted() -> None:
    document = whole()
    document.json["cameras"] = [{"name": f"c{number}"} for number in range(ROWS_KEPT + 100)]

    changes = changes_between(asset_of(whole()), asset_of(document))

    assert changes.added.cameras == ROWS_KEPT + 100
    assert len(changes.rows) == ROWS_KEPT


def test_points_that_a_mesh_lost_alter_it() -> None:
    document = whole()
    points = {"attributes": {"POSITION": 0}, "mode": 0, "material": 0}
    document.json["meshes"][0]["primitives"].append(points)

    changes = changes_between(asset_of(document), asset_of(whole()))

    assert changes.rows[0].words == (
        "mesh 'squares' differs in points: none; the reference has some"
    )


@pytest.mark.parametrize("told", [{"copyright": "me"}, {"extras": {"article": 7}}])
def test_what_a_file_says_of_the_whole_asset_is_extra_data(told: dict[str, object]) -> None:
    document = whole()
    document.json["asset"].update(told)

    changes = changes_between(asset_of(document), asset_of(whole()))

    assert counted(changes) == {"lost.extras": 1}


def test_a_group_of_an_obj_with_objects_that_is_gone_is_lost_extra_data() -> None:
    data = b"v 0 0 0\nv 1 0 0\nv 0 1 0\no box\ng lid\nf 1 2 3\n"
    reference, source = (read_asset("a.obj", each) for each in (data, data.replace(b"lid", b"top")))

    assert counted(changes_between(reference, source)) == {"lost.extras": 1, "added.extras": 1}


def test_groups_are_the_meshes_of_an_obj_without_objects() -> None:
    data = b"v 0 0 0\nv 1 0 0\nv 0 1 0\ng lid\nf 1 2 3\n"
    reference, source = (read_asset("a.obj", each) for each in (data, data.replace(b"lid", b"top")))

    assert changes_between(reference, source).lost.meshes == 1


def test_coordinates_of_a_mesh_are_the_same_whichever_of_its_nodes_is_drawn_first() -> None:
    document = one_square()
    document.json["nodes"] = [{"mesh": 0, "name": "left"}, {"mesh": 0, "name": "right"}]
    document.json["nodes"][1] |= {"scale": [-1, 1, 1], "translation": [-5, 0, 0]}
    document.json["scenes"] = [{"nodes": [0, 1]}]
    first = document.to_bytes()
    document.json["scenes"] = [{"nodes": [1, 0]}]
    files = [read_asset("a.gltf", data) for data in (first, document.to_bytes())]

    assert changes_between(*files).altered.uv_sets == 0
