"""What is told of two files that differ in more than their surface."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from meshcone.assets import Asset, read_asset
from meshcone.auditing.changes import changes_between
from meshcone.auditing.records.changes import ROWS_KEPT, Changes
from meshcone.auditing.tracks import Track
from tests.whole_asset import Document, png, whole

Damage = Callable[[dict[str, Any]], object]


def asset_of(document: Document) -> Asset:
    return read_asset("a.gltf", document.to_bytes())


def after(damage: Damage) -> Changes:
    """What changed in a copy of the asset that was damaged."""
    copy = whole()
    damage(copy.json)
    return changes_between(asset_of(whole()), asset_of(copy))


def counted(changes: Changes) -> dict[str, int]:
    return {
        f"{kind}.{what}": count
        for kind in ("lost", "added", "renamed", "moved", "altered")
        for what, count in getattr(changes, kind).model_dump().items()
        if count
    }


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


def swinging(*heights: float) -> Document:
    """The asset with an animation that lifts its bone to these heights."""
    document = whole()
    values = np.array([[0, height, 0] for height in heights], dtype="<f4")
    sampler = document.json["animations"][0]["samplers"][0]
    sampler["output"] = document.accessor(values)
    return document


@pytest.mark.parametrize(
    ("source", "found"),
    [
        (swinging(0, 1, 0), {}),
        (swinging(0, 1.001, 0), {}),
        (swinging(0, 0.5, 0), {"altered.animations": 1}),
        (swinging(0, -1, 0), {"altered.animations": 1}),
        (swinging(0, 0, 0), {"altered.animations": 1}),
    ],
)
def test_an_animation_that_moves_otherwise_is_altered(
    source: Document, found: dict[str, int]
) -> None:
    assert counted(changes_between(asset_of(swinging(0, 1, 0)), asset_of(source))) == found


def test_an_animation_in_steps_moves_otherwise() -> None:
    stepped = swinging(0, 1, 0)
    stepped.json["animations"][0]["samplers"][0]["interpolation"] = "STEP"

    changes = changes_between(asset_of(swinging(0, 1, 0)), asset_of(stepped))

    assert counted(changes) == {"altered.animations": 1}
    assert "'swing: bone translation' moves otherwise" in changes.rows[0].words


def test_a_spline_is_compared_by_its_values_at_the_keys() -> None:
    spline = whole()
    sampler = spline.json["animations"][0]["samplers"][0]
    values = np.zeros((9, 3), dtype="<f4")
    values[[1, 4, 7], 1] = 0, 1, 0  # between the tangents
    sampler.update(output=spline.accessor(values), interpolation="CUBICSPLINE")

    assert counted(changes_between(asset_of(swinging(0, 1, 0)), asset_of(spline))) == {}


def test_a_turn_is_the_same_with_its_sign_turned() -> None:
    turns = np.array([[0, 0, 0, 1], [0, 0.6, 0, 0.8]])
    one, other = Track("rotation", turns), Track("rotation", turns * [[1], [-1]])

    assert one.is_like(other)
    assert not Track("translation", turns).is_like(Track("translation", -turns))


def bound(followed: int) -> Document:
    """The asset with its second square bound to one of two joints that are at rest."""
    document = whole()
    document.json["nodes"][1]["skin"] = 0
    binds = np.tile(np.eye(4, dtype="<f4").reshape(1, 16), (2, 1))
    document.json["skins"] = [
        {"name": "rig", "joints": [2, 0], "inverseBindMatrices": document.accessor(binds)}
    ]
    # Both joints lie under the root, whose own place the first of them shares.
    primitives = document.json["meshes"][0]["primitives"]
    joints = document.accessor(np.full((4, 4), followed, dtype="|u1"))
    weights = document.accessor(np.tile(np.array([1, 0, 0, 0], dtype="<f4"), (4, 1)))
    for primitive in primitives:
        primitive["attributes"] |= {"JOINTS_0": joints, "WEIGHTS_0": weights}
    return document


def test_vertices_that_follow_another_joint_are_told_though_nothing_moves_at_rest() -> None:
    one, other = asset_of(bound(0)), asset_of(bound(1))
    np.testing.assert_array_equal(one.positions, other.positions)

    assert counted(changes_between(one, asset_of(bound(0)))) == {}
    half = bound(0)
    joints = np.array([[0] * 4, [1] * 4, [1] * 4, [0] * 4], dtype="|u1")
    primitive = half.json["meshes"][0]["primitives"][1]
    primitive["attributes"]["JOINTS_0"] = half.accessor(joints)
    found = changes_between(one, asset_of(half))

    assert counted(found) == {"altered.skins": 1}
    assert "'squares: bone' moves another part" in found.rows[0].words


def lit(**told: object) -> Document:
    """The asset with a lamp and a camera."""
    document = whole()
    lamp = {"name": "lamp", "type": "spot", "intensity": 5, "spot": {"outerConeAngle": 0.5}}
    document.json["extensions"] = {"KHR_lights_punctual": {"lights": [{**lamp, **told}]}}
    document.json["cameras"] = [
        {"name": "eye", "type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}
    ]
    return document


@pytest.mark.parametrize("told", [{"intensity": 6}, {"spot": {"outerConeAngle": 0.7}}])
def test_a_lamp_that_shines_otherwise_is_altered(told: dict[str, object]) -> None:
    changes = changes_between(asset_of(lit()), asset_of(lit(**told)))

    assert counted(changes) == {"altered.lights": 1}


def test_a_camera_that_sees_more_is_altered() -> None:
    wide = lit()
    wide.json["cameras"][0]["perspective"]["yfov"] = 1.2

    changes = changes_between(asset_of(lit()), asset_of(wide))

    assert counted(changes) == {"altered.cameras": 1}
    assert "perspective yfov" in changes.rows[0].words


def textured(library: bytes) -> Asset:
    """A triangle of an OBJ, with its one material."""
    data = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n"
    return read_asset("a.obj", data, {"a.mtl": b"newmtl paint\nKd 1 0 0\n" + library})


@pytest.mark.parametrize(
    ("library", "words"),
    [
        (b"Ns 99", "Ns: 99; the reference has 10"),
        (b"Ns 10\nKs 1 1 1", "Ks: 1 1 1; the reference has none"),
        (b"Ns 10\nillum 2", "illum: 2; the reference has none"),
        (b"", "Ns: none; the reference has 10"),
    ],
)
def test_every_statement_of_a_material_of_an_obj_is_compared(library: bytes, words: str) -> None:
    [row] = changes_between(textured(b"Ns 10"), textured(library)).rows

    assert row.words == f"material 'paint' differs in {words}"


def test_options_of_a_texture_of_an_obj_are_compared() -> None:
    deep, flat = textured(b"bump -bm 2 t.png"), textured(b"bump -bm 1 t.png")

    [row] = changes_between(deep, flat).rows

    assert row.words == ("material 'paint' differs in bump texture -bm: 1; the reference has 2")


def test_another_spelling_of_a_material_of_an_obj_is_no_change() -> None:
    one = textured(b"Ns 10\nKs .5 .5 .5\nmap_Kd -s 2 2 t.png\n")
    other = textured(
        b"\tmap_Kd -clamp off -s 2 2 1 t.png\r\nks 0.5 0.500 0.5\r\n# shine\r\nNs 10.0\r\n"
    )

    assert counted(changes_between(one, other)) == {}


def varied(*names: str, first: int = 0, second: int = 1) -> Document:
    """The asset with two variants of its first square, which is painted otherwise."""
    document = whole()
    used = [{"material": first, "variants": [0]}, {"material": second, "variants": [1]}]
    document.json["extensions"] = {
        "KHR_materials_variants": {"variants": [{"name": name} for name in names]}
    }
    primitive = document.json["meshes"][0]["primitives"][0]
    primitive["extensions"] = {"KHR_materials_variants": {"mappings": used}}
    return document


def test_a_variant_with_another_material_alters_the_mesh() -> None:
    reference, source = varied("day", "night"), varied("day", "night", second=0)

    [row] = changes_between(asset_of(reference), asset_of(source)).rows

    assert row.words == (
        "mesh 'squares' differs in variant 'night': none; the reference has glass for painted"
    )


def test_variants_that_swap_their_names_alter_the_mesh() -> None:
    reference, source = varied("day", "night"), varied("night", "day")

    assert counted(changes_between(asset_of(reference), asset_of(source))) == {"altered.meshes": 2}


def test_a_mesh_that_lost_its_variants_is_altered() -> None:
    source = varied("day", "night")
    del source.json["meshes"][0]["primitives"][0]["extensions"]

    changes = changes_between(asset_of(varied("day", "night")), asset_of(source))

    assert counted(changes) == {"altered.meshes": 1}


def test_a_variant_that_is_not_listed_is_lost_with_the_materials() -> None:
    reference, source = varied("day", "night"), varied("day", "dusk")

    changes = changes_between(asset_of(reference), asset_of(source))

    assert (changes.lost.materials, changes.added.materials) == (1, 1)


@pytest.mark.parametrize("extension", ["EXT_texture_webp", "KHR_texture_basisu"])
def test_a_texture_is_compared_by_its_image_for_those_who_know_an_extension(
    extension: str,
) -> None:
    def textured_by(number: int) -> Asset:
        document = whole()
        document.json["textures"][0]["extensions"] = {extension: {"source": number}}
        return asset_of(document)

    assert counted(changes_between(textured_by(0), textured_by(1))) == {"altered.materials": 1}


def test_points_that_a_mesh_lost_alter_it() -> None:
    document = whole()
    points = {"attributes": {"POSITION": 0}, "mode": 0, "material": 0}
    document.json["meshes"][0]["primitives"].append(points)

    changes = changes_between(asset_of(document), asset_of(whole()))

    assert changes.rows[0].words == (
        "mesh 'squares' differs in points: none; the reference has some"
    )


def test_an_image_that_neither_file_was_sent_with_is_not_compared() -> None:
    document = whole()
    document.json["images"][0] = {"uri": "wood.png"}

    changes = changes_between(asset_of(document), asset_of(document))

    assert (changes.lost.images, changes.added.images, changes.altered.materials) == (None,) * 3


def test_other_differences_are_counted_beside_an_image_that_was_not_sent() -> None:
    reference, source = whole(), whole()
    for document in (reference, source):
        document.json["images"][0] = {"uri": "wood.png"}
    source.json["materials"][1]["alphaMode"] = "MASK"

    changes = changes_between(asset_of(reference), asset_of(source))

    assert changes.altered.materials == 1


def test_materials_are_not_compared_where_neither_file_was_sent_with_their_library() -> None:
    alone = read_asset("a.obj", b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")

    assert changes_between(alone, alone).altered.materials is None


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
