"""Materials and images of an audit, against values known by other means."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.unit.auditing.squares import audit, audit_obj, one_square
from tests.whole_asset import Document, png, whole


def test_images_are_what_pillow_says_they_are() -> None:
    out = io.BytesIO()
    ramp = np.tile(np.arange(256, dtype=np.uint8), (4, 1))
    Image.fromarray(ramp).convert("RGB").save(out, "PNG")
    document = one_square()
    document.json["images"] = [
        {"bufferView": document.view(out.getvalue())},
        {"bufferView": document.view(out.getvalue())},
        {"uri": "not-sent.png"},
        {"bufferView": document.view(b"no picture at all")},
    ]

    found = audit(document).textures
    first = found.images[0]

    assert (first.width, first.height, first.format, first.power_of_two) == (256, 4, "png", True)
    assert first.luminance_mean == pytest.approx(ramp.mean(), abs=0.5)
    assert (first.luminance_p1, first.luminance_p99) == pytest.approx((2, 253), abs=1)
    assert (found.count, found.missing, found.unreadable) == (4, 1, 1)
    assert (found.duplicates, found.not_square, found.unused) == (1, None, 3)


def test_sizes_are_known_where_every_image_has_one() -> None:
    document = one_square()
    document.json["images"] += [{"bufferView": document.view(png((1, 2, 3), 30, 30))}]

    found = audit(document).textures

    assert (found.largest_width, found.largest_height) == (30, 30)
    assert (found.smallest_width, found.smallest_height) == (16, 8)
    assert (found.not_square, found.not_power_of_two) == (1, 1)


def test_without_images_there_is_no_size_to_know() -> None:
    document = one_square()
    for name in ("images", "textures", "materials"):
        del document.json[name]
    del document.json["meshes"][0]["primitives"][0]["material"]

    found = audit(document)

    assert (found.textures.largest_width, found.textures.not_square) == (0, 0)
    assert found.budget.image_bytes == 0


UNREADABLE = {"uri": "data:image/png;base64,AAAAAAAAAAAA"}


@pytest.mark.parametrize("image", [UNREADABLE, {"uri": "not-sent.png"}, {}])
def test_sizes_are_open_where_one_image_has_none(image: dict[str, str]) -> None:
    document = one_square()
    document.json["images"].append(image)

    found = audit(document).textures

    sizes = {
        *(found.largest_width, found.largest_height, found.smallest_width, found.smallest_height),
        *(found.not_square, found.not_power_of_two),
    }
    assert sizes == {None}


def test_bytes_of_images_are_open_where_one_was_not_sent() -> None:
    document = one_square()
    document.json["images"].append({"uri": "not-sent.png"})

    assert audit(document).budget.image_bytes is None
    assert audit(one_square()).budget.image_bytes == len(png((90, 90, 90), 16, 8))


def test_an_image_that_lies_about_its_size_is_not_decoded() -> None:
    data = bytearray(png((1, 2, 3)))
    data[16:24] = (60_000).to_bytes(4, "big") * 2  # width and height in the header
    document = one_square()
    document.json["images"] = [{"bufferView": document.view(bytes(data))}]

    found = audit(document).textures

    assert found.images[0].luminance_mean is None
    assert (found.not_tested, found.unreadable) == (0, 1)


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
@pytest.mark.parametrize("used", [True, False])
def test_an_image_that_is_cut_in_half_is_unreadable(kind: str, used: bool) -> None:
    out = io.BytesIO()
    noise = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    Image.fromarray(noise).save(out, kind)
    data = out.getvalue()
    document = one_square()
    document.json["images"] = [{"bufferView": document.view(data[: len(data) // 2])}]
    if not used:
        document.json["materials"] = [{}]

    found = audit(document).textures

    assert (found.unreadable, found.not_tested, found.missing) == (1, 0, 0)
    assert str(found.images[0].fault).startswith("damaged: ")


@pytest.mark.parametrize("textures", [[], [{}], [{"source": 7}]])
def test_a_texture_that_leads_to_no_image_is_missing(textures: list[dict[str, int]]) -> None:
    document = one_square()
    document.json["textures"] = textures

    assert audit(document).textures.missing == 1


def test_an_image_for_those_who_can_read_it_is_used_too() -> None:
    document = one_square()
    document.json["images"].append({"bufferView": document.view(png((9, 9, 9)))})
    document.json["textures"][0]["extensions"] = {"EXT_texture_webp": {"source": 1}}

    found = audit(document).textures

    assert found.unused == 0
    assert found.base_color_luminance_min == 9


def test_alpha_that_an_opaque_material_ignores_is_told() -> None:
    document = one_square()
    document.json["images"] = [{"bufferView": document.view(png((1, 2, 3, 9)))}]

    assert audit(document).textures.unused_alpha == 1


def two_squares_of(first: bytes, second: bytes, **material: Any) -> Document:
    """A square with two materials, each of which has a base colour of its own."""
    document = one_square()
    document.json["images"] = [{"bufferView": document.view(data)} for data in (first, second)]
    document.json["textures"] = [{"source": 0}, {"source": 1}]
    document.json["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": number}}, **material}
        for number in (0, 1)
    ]
    return document


def test_the_darkest_base_colour_is_open_where_one_of_them_cannot_be_decoded() -> None:
    black, grey = png((0, 0, 0), 64, 64), png((90, 90, 90))

    both = audit(two_squares_of(grey, black)).textures
    cut = audit(two_squares_of(grey, black[:-30])).textures

    assert (both.base_color_luminance_min, both.base_color_luminance_max) == (0, 90)
    assert cut.images[0].luminance_p1 == 90
    assert (cut.base_color_luminance_min, cut.base_color_luminance_max) == (None, None)


def test_an_image_for_something_else_does_not_keep_luminance_open() -> None:
    document = two_squares_of(png((90, 90, 90)), b"no picture at all")
    document.json["materials"][1] = {"occlusionTexture": {"index": 1}}

    assert audit(document).textures.base_color_luminance_min == 90


def test_alpha_that_may_be_ignored_is_open_where_an_image_cannot_be_decoded() -> None:
    whole_one, cut = png((1, 2, 3)), png((1, 2, 3, 9), 64, 64)[:-30]

    assert audit(two_squares_of(whole_one, cut)).textures.unused_alpha is None
    assert audit(two_squares_of(whole_one, cut, alphaMode="BLEND")).textures.unused_alpha == 0


def test_a_normal_map_that_cannot_be_decoded_may_hold_anything() -> None:
    document = two_squares_of(png((90, 90, 90)), png((9, 9, 9), 64, 64)[:-30])
    assert audit(document).textures.wrong_color_space == 0

    document.json["materials"][1] = {"normalTexture": {"index": 1}}
    assert audit(document).textures.wrong_color_space is None


def test_materials_are_listed_with_what_is_wrong() -> None:
    document = whole()
    document.json["materials"] += [{"name": "twin"}, {"name": "twin"}]
    del document.json["meshes"][0]["primitives"][0]["material"]

    found = audit(document).materials

    assert found.names == ("painted", "glass", "twin", "twin")
    assert (found.unused, found.duplicates, found.same_names) == (3, 1, 1)
    assert (found.without_material, found.blended, found.double_sided) == (2, 1, 1)


def test_a_primitive_with_a_material_that_is_not_there_is_told() -> None:
    document = one_square()
    document.json["meshes"][0]["primitives"][0]["material"] = 5

    assert audit(document).materials.undefined == 1


def test_materials_of_an_obj_that_nobody_defines_are_told() -> None:
    data = b"mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"

    found = audit_obj(data).materials

    assert (found.undefined, found.missing_libraries) == (1, 1)
