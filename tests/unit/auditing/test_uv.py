"""Texture coordinates of an audit, against values known by other means."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.unit.auditing.squares import audit, audit_obj, one_square
from tests.whole_asset import Document, png, square


def test_a_square_that_fills_its_texture_leaves_nothing_and_overlaps_nothing() -> None:
    found = audit(one_square()).uv

    assert (found.overlap_share, found.unused_share, found.inverted_share) == (0, 0, 0)
    # 16 by 8 texels over 2 by 2 units.
    assert found.texel_density_min == pytest.approx((16 * 8 / 4) ** 0.5)
    assert (found.outside, found.tiles, found.missing) == (0, False, 0)


def test_coordinates_that_are_wrong_are_counted() -> None:
    folded = square()["TEXCOORD_0"].copy()
    folded[3] = folded[1]  # the second triangle lies on the first
    gone = square()["TEXCOORD_0"].copy()
    gone[0] = np.nan
    flat = square()["TEXCOORD_0"] * np.array([1, 0], dtype="<f4")
    tiled = square()["TEXCOORD_0"] * np.float32(3)

    assert audit(one_square(TEXCOORD_0=folded)).uv.overlap_share == pytest.approx(1, abs=0.01)
    assert audit(one_square(TEXCOORD_0=folded)).uv.inverted_share == pytest.approx(0.5)
    assert audit(one_square(TEXCOORD_0=gone)).uv.not_finite == 2
    assert audit(one_square(TEXCOORD_0=flat)).uv.degenerate == 2
    assert audit(one_square(TEXCOORD_0=tiled)).uv.tiles
    assert audit(one_square(TEXCOORD_0=tiled)).uv.outside == 2


def placed_twice(**second: Any) -> Document:
    """The square at two nodes."""
    document = one_square()
    document.json["nodes"] = [{"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0], **second}]
    document.json["scenes"] = [{"nodes": [0, 1]}]
    return document


def test_a_mesh_that_two_nodes_place_does_not_overlap_itself() -> None:
    found = audit(placed_twice()).uv

    assert found.overlap_share == 0
    assert found.by_material[0].triangles == 4  # both are drawn


def test_a_mesh_that_a_node_mirrors_has_no_inverted_coordinates() -> None:
    assert audit(placed_twice(scale=[-1, 1, 1])).uv.inverted_share == 0


def test_every_node_that_places_a_mesh_counts_in_its_texel_density() -> None:
    once = audit(one_square()).uv.texel_density_min
    smaller = audit(placed_twice(scale=[0.5, 0.5, 0.5])).uv.by_material[0]

    assert smaller.texel_density_median == once
    assert smaller.texel_density_p95 == pytest.approx(2 * (once or 0))


def in_units(**transform: Any) -> Document:
    """A square whose coordinates are 4095 times as large, and a transform of its texture."""
    document = one_square(TEXCOORD_0=(4095 * square()["TEXCOORD_0"]).astype("<f4"))
    texture = document.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    texture["extensions"] = {"KHR_texture_transform": transform}
    return document


def test_coordinates_are_counted_where_the_texture_is_read_through_them() -> None:
    plain = audit(one_square()).uv

    assert audit(in_units(scale=[1 / 4095, 1 / 4095])).uv == plain


def test_a_transform_that_repeats_a_texture_tiles_it() -> None:
    found = audit(in_units(scale=[8 / 4095, -8 / 4095])).uv

    assert found.texel_density_max == pytest.approx(8 * (16 * 8 / 4) ** 0.5)
    assert (found.outside, found.tiles) == (2, True)


def density_of_obj(most: float, options: str) -> float | None:
    """Of a square of one unit whose coordinates reach from 0 to this."""
    corners = ((0, 0), (1, 0), (1, 1), (0, 1))
    lines = ["mtllib a.mtl", "usemtl red"]
    for x, y in corners:
        lines += [f"v {x} {y} 0", f"vt {most * x} {most * y}"]
    data = "\n".join([*lines, "f 1/1 2/2 3/3 4/4"]).encode()
    library = f"newmtl red\nmap_Kd {options} a.png\n".encode()
    sent = {"a.mtl": library, "a.png": png((1, 2, 3), 16, 16)}
    return audit_obj(data, **sent).uv.texel_density_min


def test_a_scale_in_a_library_is_the_same_density_as_larger_coordinates() -> None:
    assert density_of_obj(1, "-s 2 2 1 -o .25 .5 0") == pytest.approx(32)
    assert density_of_obj(2, "") == pytest.approx(32)


def beside_one_without_coordinates(**material: Any) -> Document:
    """Two squares with one material; the second has no texture coordinates."""
    document = one_square()
    [primitive] = document.json["meshes"][0]["primitives"]
    attributes = {name: n for name, n in primitive["attributes"].items() if name != "TEXCOORD_0"}
    document.json["meshes"][0]["primitives"].append({**primitive, "attributes": attributes})
    document.json["materials"][0] |= material
    return document


def test_who_has_no_texture_lacks_no_coordinates_that_another_has() -> None:
    assert audit(beside_one_without_coordinates(pbrMetallicRoughness={})).uv.missing == 0
    assert audit(beside_one_without_coordinates()).uv.missing == 2


def test_coordinates_that_are_all_no_numbers_are_there_and_wrong() -> None:
    found = audit(one_square(TEXCOORD_0=np.full((4, 2), np.nan, dtype="<f4"))).uv

    assert (found.not_finite, found.missing) == (2, 0)


def test_a_texture_that_is_read_through_a_ninth_set_lacks_it() -> None:
    document = one_square()
    texture = document.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    texture["texCoord"] = 9

    assert audit(document).uv.missing == 2


def test_a_material_with_a_texture_and_no_coordinates_lacks_them() -> None:
    document = one_square()
    del document.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]

    assert audit(document).uv.missing == 2


@pytest.mark.parametrize("scale", [1e30, -1e30])
def test_coordinates_far_away_end_in_bounded_work(scale: float) -> None:
    far = square()["TEXCOORD_0"] * np.float32(scale)

    found = audit(one_square(TEXCOORD_0=far)).uv

    assert found.overlap_share is None
    assert found.outside == 2


def test_texel_density_is_open_where_a_texture_has_no_known_size() -> None:
    document = one_square()
    document.json["images"] = [{"uri": "data:image/png;base64,AAAAAAAAAAAA"}]

    found = audit(document).uv

    assert (found.texel_density_min, found.texel_density_max) == (None, None)
    assert audit(one_square()).uv.texel_density_min is not None


def islands(*lefts: float) -> bytes:
    """An OBJ of squares, each a strip of the texture from one of these places, as wide as 0.2."""
    lines = []
    for number, left in enumerate(lefts):
        for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)):
            lines += [f"v {2 * number + x} {y} 0", f"vt {left + 0.2 * x} {0.1 + 0.8 * y}"]
        corners = " ".join(f"{4 * number + each}/{4 * number + each}" for each in (1, 2, 3, 4))
        lines.append(f"f {corners}")
    return "\n".join(lines).encode()


@pytest.mark.parametrize(
    ("lefts", "gutter"),
    [
        ((0.1, 0.3 + 10 / 1024), 10),
        ((0.1, 0.3 + 30 / 1024, 0.6), 30),
        ((0.1, 0.7), 64),
        ((0.1,), 64),
    ],
)
def test_a_gutter_lies_between_the_islands_that_are_closest(
    lefts: tuple[float, ...], gutter: int
) -> None:
    found = audit_obj(islands(*lefts)).uv.gutter

    assert found is not None
    assert abs(found - gutter) <= 1


def test_the_gutter_of_what_cannot_be_drawn_is_not_tested() -> None:
    tiled = square()["TEXCOORD_0"] * np.float32(1e6)

    assert audit(one_square(TEXCOORD_0=tiled)).uv.gutter is None


def materials_of(count: int, left: float) -> bytes:
    """An OBJ with as many materials, each with an island on the left and one from here."""
    lines = []
    corners = [(x, y, u) for u in (0.0, left) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    for number in range(count):
        lines.append(f"usemtl m{number}")
        for x, y, u in corners:
            lines += [f"v {x + 3 * u} {y} {number}", f"vt {u + 0.3 * x} {y}"]
        for first in (1, 5):
            places = (8 * number + first + each for each in range(4))
            lines.append("f " + " ".join(f"{place}/{place}" for place in places))
    return "\n".join(lines).encode()


def test_many_materials_make_no_gutter_narrower() -> None:
    one, many, most = (
        audit_obj(materials_of(count, 0.3 + 8 / 1024)).uv.gutter for count in (1, 15, 20)
    )

    assert (one, many) == (8, 8)
    assert most is None  # not drawn as finely as that
