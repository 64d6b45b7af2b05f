"""What colour a file says a place has."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from meshcone.appearance.paint import Paint, Spots
from meshcone.assets import read_asset
from meshcone.srgb import to_linear
from tests.painted import encoded, globe, painted, painted_obj, picture
from tests.whole_asset import SQUARE_FACES, square, whole


def sheet(**attributes: Any) -> dict[str, Any]:
    """A square that its texture fills, with other attributes besides."""
    return {**square(), **attributes, "faces": SQUARE_FACES}


def at(data: bytes, u: float, v: float, name: str = "a.gltf", **files: bytes) -> np.ndarray:
    """The colour where the square has coordinates (u, v)."""
    paint = Paint(read_asset(name, data, files))
    # Corners of its first triangle: (0, 1), (1, 1), (1, 0).
    weights = np.array([[1 - u, u + v - 1, 1 - v]])
    return paint.colours([Spots(np.array([0]), weights)])[0][0]


HALVES = np.array([[[255, 0, 0], [0, 0, 255]]], dtype=np.uint8)


def test_factor_texture_and_vertex_colour_are_multiplied() -> None:
    colours = np.tile(np.array([0.5, 1, 0.25, 1], dtype="<f4"), (4, 1))
    data = painted(
        encoded(HALVES),
        sheet(COLOR_0=colours),
        material={"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 1]}},
        sampler={"magFilter": 9728},
    )

    assert at(data, 0.3, 0.9) == pytest.approx((0.25, 0, 0, 1))
    assert at(data, 0.9, 0.9) == pytest.approx((0, 0, 0.25, 1))


@pytest.mark.parametrize(("mode", "opacity"), [("OPAQUE", 1.0), ("MASK", 0.0), ("BLEND", 0.25)])
def test_opacity_follows_the_alpha_mode(mode: str, opacity: float) -> None:
    material = {
        "alphaMode": mode,
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]},
    }

    assert at(painted(None, sheet(), material=material), 0.5, 0.9)[3] == opacity


def test_a_transformed_texture_is_read_where_its_transform_says() -> None:
    moved = {"extensions": {"KHR_texture_transform": {"offset": [0.5, 0]}}}
    data = painted(encoded(HALVES), sheet(), texture=moved, sampler={"magFilter": 9728})

    assert at(data, 0.3, 0.9) == pytest.approx((0, 0, 1, 1))


def test_a_mesh_without_coordinates_is_read_at_the_origin() -> None:
    arrays = sheet()
    del arrays["TEXCOORD_0"]
    data = painted(encoded(HALVES), arrays, sampler={"magFilter": 9728})

    assert at(data, 0.9, 0.9) == pytest.approx((1, 0, 0, 1))


def test_an_obj_has_the_colour_of_its_library() -> None:
    library = b"newmtl skin\nKd 0.5 1 0.25\nd 0.5\n"
    data = painted_obj(sheet())

    expected = (*to_linear(np.array([0.5, 1, 0.25])), 0.5)
    assert at(data, 0.5, 0.9, "a.obj", **{"a.mtl": library}) == pytest.approx(expected)


def test_an_obj_has_the_colours_of_its_texture() -> None:
    files = {"a.mtl": b"newmtl skin\nmap_Kd a.png\n", "a.png": encoded(HALVES)}
    data = painted_obj(sheet())

    assert at(data, 0.25, 0.95, "a.obj", **files) == pytest.approx((1, 0, 0, 1))
    assert at(data, 0.75, 0.95, "a.obj", **files) == pytest.approx((0, 0, 1, 1))


def test_colours_of_an_obj_s_vertices_are_as_encoded() -> None:
    data = b"v 0 0 0 .5 1 0\nv 1 0 0 .5 1 0\nv 1 1 0 .5 1 0\nf 1 2 3\n"

    expected = (*to_linear(np.array([0.5, 1, 0])), 1)
    assert at(data, 0.5, 0.9, "a.obj") == pytest.approx(expected)


def test_two_formats_of_one_asset_have_the_same_colours() -> None:
    image = encoded(picture())
    files = {"a.mtl": b"newmtl skin\nmap_Kd a.png\n", "a.png": image}
    gltf = Paint(read_asset("a.gltf", painted(image)))
    obj = Paint(read_asset("a.obj", painted_obj(), files))
    rng = np.random.default_rng(5)
    spots = Spots(rng.integers(0, len(globe()["faces"]) - 64, 300), rng.dirichlet((1, 1, 1), 300))

    (first,), (second,) = gltf.colours([spots]), obj.colours([spots])

    assert first == pytest.approx(second, abs=1e-6)


def test_each_material_paints_its_own_faces() -> None:
    paint = Paint(read_asset("a.gltf", whole().to_bytes()))
    middle = np.full((4, 3), 1 / 3)

    (found,) = paint.colours([Spots(np.arange(4), middle)])

    brown = to_linear(np.array([200, 100, 50]) / 255)
    assert found[:2, :3] == pytest.approx(np.tile(brown, (2, 1)))
    assert found[2:] == pytest.approx(np.tile([0, 0, 1, 0.5], (2, 1)))


# A header of 4 by 4 texels and one level, which is empty.
KTX2 = (
    b"\xabKTX 20\xbb\r\n\x1a\n" + np.array([37, 1, 4, 4, 0, 0, 1, 1], "<u4").tobytes() + bytes(60)
)


@pytest.mark.parametrize(
    ("image", "why"),
    [
        (KTX2, "KTX2 images are not decoded"),
        (b"no picture", "no PNG, JPEG, WebP or KTX2"),
        (encoded(picture())[:200], "damaged"),
    ],
)
def test_an_image_that_cannot_be_decoded_leaves_the_colour_unknown(image: bytes, why: str) -> None:
    paint = Paint(read_asset("a.gltf", painted(image)))

    (found,) = paint.colours([Spots(np.array([5]), np.full((1, 3), 1 / 3))])

    assert np.isnan(found).all()
    assert paint.why_unknown is not None
    assert "a.gltf: image" in paint.why_unknown
    assert why in paint.why_unknown


def test_a_material_that_no_library_defines_has_no_known_colour() -> None:
    paint = Paint(read_asset("a.obj", painted_obj()))

    (found,) = paint.colours([Spots(np.array([0]), np.full((1, 3), 1 / 3))])

    assert np.isnan(found).all()
    assert not paint.has_colour
    assert paint.why_unknown == "a.obj: no library defines the material 'skin'"


def test_more_texels_than_are_decoded_together_leave_all_colours_unknown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("meshcone.appearance.paint._MOST_TEXELS", 64 * 32 - 1)
    paint = Paint(read_asset("a.gltf", painted(encoded(picture(64, 32)))))

    (found,) = paint.colours([Spots(np.array([5]), np.full((1, 3), 1 / 3))])

    assert np.isnan(found).all()
    assert "its textures together have more than the 2,047 texels" in (paint.why_unknown or "")
