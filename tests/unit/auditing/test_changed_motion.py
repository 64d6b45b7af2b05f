"""What is told of animations, skins, lights and cameras that differ."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.auditing.changes import changes_between
from meshcone.auditing.tracks import Track
from tests.unit.auditing.damaged import asset_of, counted
from tests.whole_asset import Document, whole


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


def test_an_animation_whose_values_became_no_numbers_is_altered() -> None:
    one, other = swinging(0, 1, 0), swinging(0, np.nan, 0)
    for document in (one, other):  # another channel, which keeps the duration
        [animation] = document.json["animations"]
        animation["samplers"].append(dict(whole().json["animations"][0]["samplers"][0]))
        target = {"node": 1, "path": "translation"}
        animation["channels"].append({"sampler": 1, "target": target})

    changes = changes_between(asset_of(one), asset_of(other))

    assert counted(changes) == {"altered.animations": 1}
    assert "differs in channels that are no numbers: 1" in changes.rows[0].words


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


def twins(moved: int) -> Document:
    """The asset with two more nodes of one name, each with a channel; one of them moves."""
    document = swinging(0, 1, 0)
    first = len(document.json["nodes"])
    document.json["nodes"] += [{"name": "twin"}, {"name": "twin"}]
    document.json["scenes"][0]["nodes"] += [first, first + 1]
    [animation] = document.json["animations"]
    for which in range(2):
        values = np.zeros((3, 3), dtype="<f4")
        values[1] = which == moved
        sampler = {**animation["samplers"][0], "output": document.accessor(values)}
        animation["samplers"].append(sampler)
        target = {"node": first + which, "path": "translation"}
        animation["channels"].append({"sampler": which + 1, "target": target})
    return document


def test_each_of_two_nodes_of_one_name_moves_as_it_did() -> None:
    changes = changes_between(asset_of(twins(0)), asset_of(twins(1)))

    assert counted(changes) == {"altered.animations": 2}


def test_a_channel_whose_values_no_longer_fit_its_keys_is_altered() -> None:
    short = whole()  # four values for three keys
    sampler = short.json["animations"][0]["samplers"][0]
    sampler["output"] = short.accessor(np.zeros((2, 2), dtype="<f4"))

    changes = changes_between(asset_of(swinging(0, 1, 0)), asset_of(short))

    assert counted(changes) == {"altered.animations": 1}
    assert changes.rows[0].source == "values that do not fit the keys"


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

    assert counted(found) == {"altered.skins": 2}
    assert "'squares: bone' moves another part" in found.rows[0].words


def test_vertices_that_follow_another_joint_of_the_same_name_are_told() -> None:
    one, other = bound(0), bound(0)
    for document, joints in (one, [[0] * 4, [1] * 4] * 2), (other, [[1] * 4, [0] * 4] * 2):
        primitive = document.json["meshes"][0]["primitives"][1]
        values = np.array(joints, dtype="|u1")
        primitive["attributes"]["JOINTS_0"] = document.accessor(values)
        document.json["nodes"][0]["name"] = document.json["nodes"][2]["name"] = "arm: upper"

    changes = changes_between(asset_of(one), asset_of(other))

    assert counted(changes)["altered.skins"] >= 1


def test_a_mesh_that_follows_another_joint_as_a_whole_is_told() -> None:
    changes = changes_between(asset_of(bound(0)), asset_of(bound(1)))

    assert counted(changes) == {"altered.skins": 2}


def test_vertices_whose_weights_became_no_numbers_follow_no_joint() -> None:
    damaged = bound(0)
    weights = damaged.accessor(np.full((4, 4), np.nan, dtype="<f4"))
    damaged.json["meshes"][0]["primitives"][1]["attributes"]["WEIGHTS_0"] = weights

    changes = changes_between(asset_of(bound(0)), asset_of(damaged))

    assert counted(changes) == {"altered.skins": 1}


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
