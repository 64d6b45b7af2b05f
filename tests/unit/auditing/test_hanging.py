"""What is told of two files of which a node has something, and the other's node has not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from meshcone.assets import read_asset
from meshcone.auditing.changes import changes_between
from meshcone.auditing.records.changes import Changes
from tests.whole_asset import whole

Damage = Callable[[dict[str, Any]], object]


def furnished(damage: Damage = lambda _: None) -> bytes:
    """The asset with its mesh skinned, a mesh of points, a camera and a light."""
    document = whole()
    points = {"attributes": {"POSITION": 0}, "mode": 0}
    document.json["meshes"].append({"name": "dust", "primitives": [points]})
    document.json["cameras"] = [{"name": "eye", "type": "perspective"}]
    lights = {"lights": [{"name": "lamp", "type": "point"}]}
    document.json["extensions"] = {"KHR_lights_punctual": lights}
    nodes = document.json["nodes"]
    nodes[0]["children"] += [3, 4, 5]
    nodes[1]["skin"] = 0
    nodes += [
        {"name": "cloud", "mesh": 1},
        {"name": "view", "camera": 0},
        {"name": "bulb", "extensions": {"KHR_lights_punctual": {"light": 0}}},
    ]
    damage(document.json)
    return document.to_bytes()


def after(damage: Damage) -> Changes:
    reference, source = (read_asset("a.gltf", each) for each in (furnished(), furnished(damage)))
    return changes_between(reference, source)


@pytest.mark.parametrize(
    ("damage", "what", "words"),
    [
        (
            lambda d: d["nodes"][3].pop("mesh"),
            "nodes",
            "node 'root/cloud' differs in mesh: none; the reference has dust",
        ),
        (
            lambda d: d["nodes"][3].update(mesh=0),
            "nodes",
            "node 'root/cloud' differs in mesh: squares; the reference has dust",
        ),
        (
            lambda d: d["nodes"][1].pop("skin"),
            "skins",
            "skin 'root/plain' is at its node no more; the reference has rig",
        ),
        (
            lambda d: d["nodes"][4].pop("camera"),
            "cameras",
            "camera 'root/view' is at its node no more; the reference has eye",
        ),
        (
            lambda d: d["nodes"][5].pop("extensions"),
            "lights",
            "light 'root/bulb' is at its node no more; the reference has lamp",
        ),
        (
            lambda d: d["nodes"][3].update(extensions={"KHR_node_visibility": {"visible": False}}),
            "nodes",
            "node 'root/cloud' differs in visibility: hidden; the reference has shown",
        ),
    ],
)
def test_what_a_node_has_no_more_is_altered_though_the_file_still_lists_it(
    damage: Damage, what: str, words: str
) -> None:
    told = [(row.kind, row.words) for row in after(damage).rows if row.what == what]

    assert told == [("altered", words)]


def test_a_mesh_without_its_skin_is_told_whatever_its_node_is_called() -> None:
    changes = after(lambda d: (d["nodes"][1].pop("skin"), d["nodes"][1].update(name="other")))

    assert (changes.lost.nodes, changes.altered.skins) == (1, 1)


def test_what_is_not_listed_any_more_is_told_once() -> None:
    changes = after(lambda d: (d.pop("cameras"), d["nodes"][4].pop("camera")))

    assert [(row.kind, row.what) for row in changes.rows] == [("lost", "cameras")]


def in_another_order(document: dict[str, Any]) -> None:
    document["meshes"].reverse()
    for node in (1, 3):
        document["nodes"][node]["mesh"] = 1 - document["nodes"][node]["mesh"]


def test_another_order_of_meshes_is_no_difference() -> None:
    assert after(in_another_order).rows == ()


def test_meshes_without_names_in_another_order_are_no_other_meshes_at_their_nodes() -> None:
    def unnamed(document: dict[str, Any]) -> None:
        for mesh in document["meshes"]:
            del mesh["name"]

    reference = furnished(unnamed)
    source = furnished(lambda d: (unnamed(d), in_another_order(d)))

    changes = changes_between(*(read_asset("a.gltf", each) for each in (reference, source)))

    assert changes.altered.nodes == 0


def test_a_node_that_is_said_to_be_shown_is_shown_as_before() -> None:
    shown = {"KHR_node_visibility": {"visible": True}}

    assert after(lambda d: d["nodes"][3].update(extensions=shown)).rows == ()


def test_a_node_that_places_its_mesh_fewer_times_is_altered() -> None:
    def instanced(count: int) -> bytes:
        document = whole()
        attributes = {"TRANSLATION": 0}
        document.json["accessors"][0]["count"] = count
        document.json["nodes"][1]["extensions"] = {
            "EXT_mesh_gpu_instancing": {"attributes": attributes}
        }
        primitives = document.json["meshes"][0]["primitives"]
        document.json["meshes"][0]["primitives"] = [primitives[1]]
        return document.to_bytes()

    [row] = changes_between(*(read_asset("a.gltf", instanced(n)) for n in (4, 3))).rows

    assert row.words == "node 'root/plain' differs in number of instances: 3; the reference has 4"
