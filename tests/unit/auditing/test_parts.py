"""Where meshes have their materials and attributes, in two files that differ in that."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.auditing.changes import changes_between
from meshcone.auditing.records.changes import Changes
from tests.unit.auditing.damaged import asset_of, counted
from tests.whole_asset import SQUARE_FACES, Document, square, whole

Edit = Callable[[dict[str, Any]], object]
TURN = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def primitives(document: dict[str, Any]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = document["meshes"][0]["primitives"]
    return found


def exchange(document: dict[str, Any]) -> None:
    for primitive, material in zip(primitives(document), (1, 0), strict=True):
        primitive["material"] = material


def after(edit: Edit, made: Document | None = None) -> Changes:
    """What changed in a copy of an asset that was edited."""
    first = asset_of(made or whole())
    copy = made or whole()
    edit(copy.json)
    return changes_between(first, asset_of(copy))


def test_materials_that_two_parts_exchange_alter_the_mesh() -> None:
    changes = after(exchange)

    assert counted(changes) == {"altered.meshes": 1}
    assert changes.rows[0].words == "mesh 'squares' has its materials elsewhere"
    assert "'painted' on 50 % of the mesh, around (-0.53" in str(changes.rows[0].reference)


def test_materials_without_names_are_told_apart() -> None:
    document = whole()
    for material in document.json["materials"]:
        del material["name"]

    assert counted(after(exchange, document)) == {"altered.meshes": 1}


@pytest.mark.parametrize(
    ("name", "what"),
    [("NORMAL", "attributes"), ("TEXCOORD_0", "uv_sets")],
)
def test_what_one_part_lacks_is_lost(name: str, what: str) -> None:
    changes = after(lambda document: primitives(document)[1]["attributes"].pop(name))

    assert counted(changes)[f"lost.{what}"] == 1
    assert changes.rows[0].words.endswith(
        f"'squares: {name}' is on 50 % of the mesh, and not 100 %"
    )


def test_what_one_part_has_besides_is_added() -> None:
    copy = whole()
    primitives(copy.json)[0]["attributes"].pop("NORMAL")

    changes = changes_between(asset_of(copy), asset_of(whole()))

    assert counted(changes) == {"added.attributes": 1}
    assert "is new on a part; the reference has it on 50 % of the mesh" in changes.rows[0].words


def test_a_morph_target_that_one_part_lacks_is_lost() -> None:
    document = whole()
    for primitive in primitives(document.json):
        primitive["targets"] = [{"POSITION": 0}]

    def without_one(document: dict[str, Any]) -> None:
        del primitives(document)[0]["targets"]

    assert counted(after(without_one, document)) == {"lost.morph_targets": 1}


def test_what_a_small_part_lacks_is_lost() -> None:
    document = whole()
    small = document.accessor((square(0.1)["POSITION"] + np.float32([3, 0, 0])).astype("<f4"))
    primitives(document.json)[1]["attributes"]["POSITION"] = small

    changes = after(lambda found: primitives(found)[1]["attributes"].pop("NORMAL"), document)

    assert counted(changes) == {"lost.attributes": 1}
    assert "0 % of what has material 'glass', and not 100 %" in changes.rows[0].words


def test_other_primitives_of_the_same_materials_are_no_change() -> None:
    divided = whole()
    first = primitives(divided.json)[0]
    halves = [divided.accessor(face.reshape(-1, 1)) for face in SQUARE_FACES]
    first["indices"] = halves[0]
    primitives(divided.json).append({**first, "indices": halves[1]})

    assert counted(changes_between(asset_of(whole()), asset_of(divided))) == {}
    assert counted(changes_between(asset_of(divided), asset_of(whole()))) == {}


def two_instances(order: tuple[int, int]) -> Document:
    document = whole()
    instances = [
        {"name": "here", "mesh": 0},
        {"name": "there", "mesh": 0, "rotation": [0, 0, 1, 0], "translation": [9, 0, 0]},
    ]
    document.json["nodes"] = [instances[number] for number in order]
    document.json["scenes"] = [{"name": "room", "nodes": [0, 1]}]
    del document.json["animations"], document.json["skins"]
    return document


def test_another_order_of_turned_instances_is_no_change() -> None:
    one, other = (asset_of(two_instances(order)) for order in ((0, 1), (1, 0)))

    assert counted(changes_between(one, other)) == {}


CUBE = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]


def cube(first: str, second: str, turned: bool = False, coordinates: int = 6) -> bytes:
    """A cube whose faces along x have one material, and all others another."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    if turned:
        corners = corners @ TURN[:3, :3].T
    lines = [f"v {x} {y} {z}" for x, y, z in corners.tolist()] + ["vt 0 0", f"usemtl {first}"]
    for number, face in enumerate(CUBE):
        lines += [f"usemtl {second}"] if number == 2 else []
        lines += ["f " + " ".join(f"{v}/1" if number < coordinates else f"{v}" for v in face)]
    return "\n".join(lines).encode()


def test_materials_with_one_centre_are_told_apart() -> None:
    """Of the faces along x and y, and along z, each pair has its centre in the middle."""
    faces = "usemtl {}\nf 1 2 4 3\nf 5 7 8 6\nusemtl {}\nf 1 5 6 2\nf 3 4 8 7\n"
    corners = b"".join(b"v %d %d %d\n" % (x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1))
    one, other = (
        read_asset("a.obj", corners + faces.format(*names).encode())
        for names in (("red", "blue"), ("blue", "red"))
    )

    assert counted(changes_between(one, other)) == {"altered.meshes": 1}


def test_an_obj_that_lost_the_coordinates_of_some_faces_lost_them() -> None:
    one, other = (read_asset("a.obj", cube("red", "blue", coordinates=count)) for count in (6, 4))

    changes = changes_between(one, other)

    assert changes.lost.uv_sets == 1


def test_a_source_that_is_brought_to_its_reference_is_compared_there() -> None:
    one, other = (read_asset("a.obj", cube("red", "blue", turned)) for turned in (False, True))

    assert changes_between(one, other).altered.meshes == 1
    assert changes_between(one, other, np.linalg.inv(TURN)).altered.meshes == 0
