"""Names in OBJ files and their material libraries."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from meshcone.assets import read_asset
from meshcone.assets.content import Content

CORNERS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
RED, WHITE = (1, 0, 0, 1), (1, 1, 1, 1)


def content(statements: bytes, resources: Mapping[str, bytes]) -> Content:
    return read_asset("a.obj", statements + b"\n" + CORNERS + b"f 1 2 3\n", resources).content()


def test_names_that_differ_after_a_number_sign_are_of_two_materials() -> None:
    library = b"newmtl Mat #1\nKd 1 0 0 # red\nnewmtl Mat #2\nKd 1 1 1\n"

    found = content(b"mtllib a.mtl\nusemtl Mat #2", {"a.mtl": library})

    colors = {each.name: each.base_color for each in found.materials}
    assert colors == {"Mat #1": RED, "Mat #2": WHITE}
    assert [draw.material for draw in found.draws] == [1]


@pytest.mark.parametrize("keyword", [b"o", b"g"])
def test_a_number_sign_is_part_of_the_name_of_a_part(keyword: bytes) -> None:
    assert content(keyword + b" Box_#25", {}).meshes[0].name == "Box_#25"


def test_a_number_sign_ends_no_name_of_an_image() -> None:
    resources = {"a.mtl": b"newmtl a\nmap_Kd wood #1.png\n", "wood #1.png": b"wood"}

    [image] = content(b"mtllib a.mtl", resources).images

    assert (image.name, image.data) == ("wood #1.png", b"wood")


def test_a_comment_after_the_name_of_an_image_that_was_sent_is_no_part_of_it() -> None:
    resources = {"a.mtl": b"newmtl a\nmap_Kd wood.png # oak\n", "wood.png": b"wood"}

    [image] = content(b"mtllib a.mtl", resources).images

    assert (image.name, image.data) == ("wood.png", b"wood")


@pytest.mark.parametrize(
    ("statement", "libraries"),
    [
        (b"mtllib set #1.mtl", {"set #1.mtl": True}),
        (b"mtllib a b.mtl # two words", {"a b.mtl": True}),
        (b"mtllib gone.mtl # a comment", {"gone.mtl": False}),
        (b"mtllib gone#1.mtl", {"gone#1.mtl": False}),
        ("mtllib gone\u00a0b.mtl c.mtl".encode(), {"gone\u00a0b.mtl": False, "c.mtl": False}),
        (b"mtllib # none", {}),
    ],
)
def test_what_was_sent_decides_where_the_name_of_a_library_ends(
    statement: bytes, libraries: dict[str, bool]
) -> None:
    resources = dict.fromkeys(("set #1.mtl", "a b.mtl"), b"newmtl a\n")

    assert content(statement, resources).libraries == libraries


@pytest.mark.parametrize(
    "library",
    [
        b"newmtl\tpaint\nKd\t1 0 0\n",
        b"\tnewmtl\t paint\n\tKd \t1\t0\t0\n",
        b"\xef\xbb\xbfnewmtl paint\nKd 1 0 0\n",
    ],
    ids=["tabs", "tabs and blanks", "byte order mark"],
)
def test_tabs_and_a_byte_order_mark_change_no_material(library: bytes) -> None:
    [material] = content(b"mtllib a.mtl", {"a.mtl": library}).materials

    assert (material.name, material.base_color) == ("paint", RED)
