"""Images that materials take for colours, for data or for both."""

from __future__ import annotations

import pytest

from tests.unit.auditing.squares import audit, audit_obj, one_square
from tests.whole_asset import Document, png, whole


def test_an_image_that_is_colour_and_data_at_once_is_told() -> None:
    document = one_square()
    document.json["materials"][0]["normalTexture"] = {"index": 0}

    assert audit(document).textures.wrong_color_space == 1
    assert audit(whole()).textures.wrong_color_space == 0


def shared_by(extension: str, *slots: str) -> Document:
    """A square whose one image is bound to these slots of an extension."""
    document = one_square()
    bound = {slot: {"index": 0} for slot in slots}
    document.json["materials"] = [{"extensions": {extension: bound}}]
    return document


@pytest.mark.parametrize(
    ("extension", "color", "alpha"),
    [
        ("KHR_materials_sheen", "sheenColorTexture", "sheenRoughnessTexture"),
        ("KHR_materials_specular", "specularColorTexture", "specularTexture"),
        (
            "KHR_materials_diffuse_transmission",
            "diffuseTransmissionColorTexture",
            "diffuseTransmissionTexture",
        ),
        ("VRMC_materials_mtoon", "shadeMultiplyTexture", "rimMultiplyTexture"),
    ],
)
def test_what_reads_alpha_alone_shares_an_image_with_colours_and_with_data(
    extension: str, color: str, alpha: str
) -> None:
    with_color = shared_by(extension, color, alpha)
    with_data = shared_by(extension, alpha)
    with_data.json["materials"][0]["occlusionTexture"] = {"index": 0}

    assert audit(with_color).textures.wrong_color_space == 0
    assert audit(with_data).textures.wrong_color_space == 0


@pytest.mark.parametrize(
    ("extension", "slots"),
    [
        ("KHR_materials_pbrSpecularGlossiness", ("diffuseTexture", "specularGlossinessTexture")),
        ("KHR_materials_clearcoat", ("clearcoatTexture", "clearcoatRoughnessTexture")),
        ("KHR_materials_iridescence", ("iridescenceTexture", "iridescenceThicknessTexture")),
    ],
)
def test_slots_that_hold_the_same_kind_share_an_image(
    extension: str, slots: tuple[str, ...]
) -> None:
    assert audit(shared_by(extension, *slots)).textures.wrong_color_space == 0


@pytest.mark.parametrize(
    ("extension", "slot"),
    [
        ("KHR_materials_volume", "thicknessTexture"),
        ("KHR_materials_transmission", "transmissionTexture"),
        ("KHR_materials_anisotropy", "anisotropyTexture"),
    ],
)
def test_what_reads_channels_of_colours_as_data_is_told(extension: str, slot: str) -> None:
    document = shared_by(extension, slot)
    document.json["materials"][0]["emissiveTexture"] = {"index": 0}

    assert audit(document).textures.wrong_color_space == 1


def test_a_normal_map_of_a_clear_coat_holds_normals() -> None:
    document = shared_by("KHR_materials_clearcoat", "clearcoatNormalTexture")
    assert audit(document).textures.wrong_color_space == 1  # it is grey

    document.json["images"] = [{"bufferView": document.view(png((128, 128, 255)))}]
    assert audit(document).textures.wrong_color_space == 0


def wrong_in_library(*statements: str) -> int | None:
    library = "\n".join(["newmtl red", *(f"{each} a.png" for each in statements)]).encode()
    data = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"
    sent = {"a.mtl": library, "a.png": png((1, 2, 3))}
    return audit_obj(data, **sent).textures.wrong_color_space


def test_the_colours_of_a_library_and_its_opacity_share_an_image() -> None:
    assert wrong_in_library("map_Ka", "map_Kd", "map_Ks", "map_d") == 0
    assert wrong_in_library("map_Kd", "map_Bump") == 1
