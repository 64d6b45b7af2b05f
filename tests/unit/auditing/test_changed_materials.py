"""What is told of materials, their variants and their images that differ."""

from __future__ import annotations

import pytest

from meshcone.assets import Asset, read_asset
from meshcone.auditing.changes import changes_between
from tests.unit.auditing.damaged import asset_of, counted
from tests.whole_asset import Document, whole


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
