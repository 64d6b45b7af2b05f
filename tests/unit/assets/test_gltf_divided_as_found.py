"""Attributes that are not as they should be, of vertices between which others come to lie."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meshcone.assets import WritePolicy, read_asset
from meshcone.errors import InputError
from tests.unit.assets.builders import Gltf, chunks
from tests.unit.assets.dividing import SQUARE, divided, square
from tests.unit.assets.plain_gltf import table

UP = SQUARE * 0 + np.float32([0, 0, 1])
SIDE = np.tile(np.float32([1, 0, 0, 1]), (4, 1))
SIDES = list(range(5))


def undeclared(gltf: Gltf) -> Gltf:
    """Without bounds of what is not finite, for which JSON has no word."""
    for accessor in gltf.json["accessors"][1:]:
        del accessor["min"], accessor["max"]
    return gltf


def broken(values: NDArray[Any], number: float) -> NDArray[Any]:
    """The same with one vertex that has no finite value."""
    found = values.copy()
    found[0] = number
    return found


@pytest.mark.parametrize("number", [np.nan, np.inf])
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("TEXCOORD_0", SQUARE[:, :2]),
        ("COLOR_0", SIDE),
        ("NORMAL", UP),
        ("TANGENT", SIDE),
        ("_HEAT", SQUARE[:, :1]),
    ],
)
@pytest.mark.filterwarnings("error")
def test_beside_what_is_not_finite_the_rest_is_what_lies_there(
    name: str, values: NDArray[Any], number: float
) -> None:
    found = {"NORMAL": UP, name: broken(values, number)}
    gltf = undeclared(square(**found))

    after, _ = divided(gltf.glb(), SIDES)

    attributes = chunks(after)[0]["meshes"][0]["primitives"][0]["attributes"]
    written = table(after, attributes[name])
    assert written[:4].tobytes() == found[name].tobytes()
    assert len(written) == len(table(after, attributes["POSITION"])) > 4
    assert np.isfinite(written[4:]).any()


def test_weights_that_are_no_numbers_have_none_between_them() -> None:
    joints = np.zeros((4, 4), dtype=np.uint8)
    after, _ = divided(
        undeclared(square(JOINTS_0=joints, WEIGHTS_0=broken(SIDE * SIDE, np.nan))).glb(), SIDES
    )
    attributes = chunks(after)[0]["meshes"][0]["primitives"][0]["attributes"]
    assert np.isnan(table(after, attributes["WEIGHTS_0"])).any()


def morphed(name: str, values: NDArray[Any]) -> Gltf:
    gltf = square()
    gltf.json["meshes"][0]["primitives"][0]["targets"] = [{name: gltf.accessor(values)}]
    return gltf


@pytest.mark.parametrize(
    ("gltf", "words"),
    [
        (square(TEXCOORD_0=SQUARE[:3, :2]), "3 of TEXCOORD_0 for 4 positions"),
        (square(TEXCOORD_0=np.tile(SQUARE, (2, 1))[:, :2]), "8 of TEXCOORD_0 for 4 positions"),
        (square(COLOR_0=SIDE[:2]), "2 of COLOR_0 for 4 positions"),
        (square(_HEAT=SQUARE[:1, :1]), "1 of _HEAT for 4 positions"),
        (morphed("NORMAL", UP[:3]), "3 of NORMAL for 4 positions"),
        (square(TANGENT=SQUARE), "TANGENT must be VEC4, found VEC3"),
        (square(JOINTS_2=SQUARE.astype(np.uint8)), "JOINTS_2 must be VEC4, found VEC3"),
    ],
    ids=["short", "long", "colours", "own", "target", "tangents", "joints"],
)
def test_attributes_that_do_not_fit_the_positions_are_refused_before_anything_is_solved(
    gltf: Gltf, words: str
) -> None:
    asset = read_asset("a.glb", gltf.glb())
    with pytest.raises(InputError, match=words) as refused:
        asset.ensure_divisible(WritePolicy())
    assert refused.value.file == "a.glb"
    assert str(refused.value.place).startswith("/accessors/")
    with pytest.raises(InputError, match=words):
        divided(gltf.glb(), [0])


def test_attributes_of_what_is_not_selected_are_nobodys_concern() -> None:
    gltf = square(TEXCOORD_0=SQUARE[:3, :2])
    other = {"POSITION": gltf.accessor(SQUARE + np.float32([5, 0, 0]))}
    gltf.node(mesh=gltf.mesh({"attributes": other, "indices": 2}))
    asset = read_asset("a.glb", gltf.glb())
    asset.ensure_divisible(WritePolicy(selected=np.arange(4) >= 2))


def test_a_file_with_attributes_that_do_not_fit_is_measured() -> None:
    asset = read_asset("a.glb", square(TEXCOORD_0=SQUARE[:3, :2]).glb())
    assert len(asset.faces) == 2


def test_an_accessor_named_by_a_number_with_a_point_is_divided() -> None:
    gltf = square(TEXCOORD_0=SQUARE[:, :2])
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 1.0
    after, _ = divided(gltf.glb(), [0])
    assert len(table(after, 1)) == 5


def test_what_reaches_past_its_buffer_does_not_begin_to_read_what_is_appended() -> None:
    gltf = square(TEXCOORD_0=SQUARE[:, :2])
    past = {"buffer": 0, "byteOffset": 0, "byteLength": len(gltf.binary) + 4}
    gltf.json["bufferViews"].append(past)
    gltf.json["images"] = [{"bufferView": len(gltf.json["bufferViews"]) - 1}]

    after, _ = divided(gltf.glb(), SIDES)

    document, _ = chunks(after)
    assert document["buffers"][0]["byteLength"] == len(gltf.binary)
    assert document["bufferViews"][document["images"][0]["bufferView"]] == past
    assert len(read_asset("a.glb", after).faces) > 2
