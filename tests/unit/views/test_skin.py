"""One picture has all colours of a surface, whatever they come from."""

from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from meshcone.appearance.paint import Paint, Spots
from meshcone.assets import read_asset
from meshcone.srgb import to_encoded
from meshcone.surface import Mesh
from meshcone.views.skin import Origin, Skin, skin_of
from tests.painted import encoded, globe, painted, picture

GLOBE = globe(24, 12)


@pytest.fixture(scope="module")
def coloured() -> tuple[Mesh, Paint]:
    asset = read_asset("globe.gltf", painted(encoded(picture(64, 32)), GLOBE))
    return Mesh(asset.vertices, asset.faces), Paint(asset)


def looked_up(skin: Skin, faces: NDArray[np.int64], weights: NDArray[np.float64]) -> np.ndarray:
    """What a viewer shows at points (k,): the picture there, filtered between four texels."""
    pixels = np.asarray(Image.open(io.BytesIO(skin.image)), dtype=float) / 255
    at = np.einsum("kc,kcd->kd", weights, skin.corners[faces].astype(float))
    low = np.floor(at).astype(int)
    share = at - low
    found = np.zeros((len(at), 3))
    for right, down in ((0, 0), (1, 0), (0, 1), (1, 1)):
        part = np.abs(1 - right - share[:, 0]) * np.abs(1 - down - share[:, 1])
        rows, columns = (low + np.array([right, down])).clip(0, skin.side - 1)[:, ::-1].T
        found += part[:, None] * pixels[rows, columns]
    return found


def spots(count: int, faces: int) -> Spots:
    random = np.random.default_rng(5)
    return Spots(random.integers(0, faces, count), random.dirichlet([1, 1, 1], count))


def test_a_skin_shows_the_colours_of_the_texture(coloured: tuple[Mesh, Paint]) -> None:
    mesh, paint = coloured
    skin = skin_of(mesh, Origin(paint, np.arange(len(mesh.faces)), mesh), 512)
    somewhere = spots(2000, len(mesh.faces))

    expected = to_encoded(paint.colours([somewhere])[0][:, :3])

    error = np.abs(looked_up(skin, somewhere.faces, somewhere.weights) - expected)
    assert error.mean() < 0.01
    assert np.quantile(error, 0.95) < 0.05  # the rest is the texture's own seam


def test_a_surface_with_fewer_triangles_has_the_colours_beneath(
    coloured: tuple[Mesh, Paint],
) -> None:
    whole, paint = coloured
    coarse = read_asset("coarse.gltf", painted(encoded(picture(64, 32)), globe(12, 6)))
    light = Mesh(coarse.vertices, coarse.faces)
    skin = skin_of(light, Origin(paint, None, whole), 512)
    somewhere = spots(2000, len(light.faces))

    # The texture is a map of the world: on the ball, a coarser one has the same colours.
    expected = to_encoded(Paint(coarse).colours([somewhere])[0][:, :3])

    assert np.abs(looked_up(skin, somewhere.faces, somewhere.weights) - expected).mean() < 0.05


@given(st.lists(st.floats(0, 1e3, allow_subnormal=False), min_size=1, max_size=60))
def test_no_texel_is_under_two_triangles(legs: list[float]) -> None:
    count = len(legs)
    corners = np.array([[[0, 0, k], [leg, 0, k], [0, leg, k]] for k, leg in enumerate(legs)])
    mesh = Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    asset = read_asset("globe.gltf", painted(None, GLOBE))
    origin = Origin(Paint(asset), np.zeros(count, dtype=np.int64), mesh)

    skin = skin_of(mesh, origin, 64)

    covered = np.zeros((skin.side, skin.side), dtype=int)
    for begin, along, across in skin.corners.astype(int):
        leg = int(np.abs(along - begin).max())
        for right, down in ((i, j) for i in range(leg + 1) for j in range(leg + 1 - i)):
            x, y = begin + right * np.sign(along - begin) + down * np.sign(across - begin)
            covered[y, x] += 1
    assert covered.max() == 1


def test_large_triangles_have_more_of_the_picture(coloured: tuple[Mesh, Paint]) -> None:
    large_one, small_one = [[0, 0, 0], [8, 0, 0], [0, 8, 0]], [[1, 1, 1], [2, 1, 1], [1, 2, 1]]
    mesh = Mesh(np.array(large_one + small_one, dtype=float), np.array([[0, 1, 2], [3, 4, 5]]))
    skin = skin_of(mesh, Origin(coloured[1], np.array([0, 1]), mesh), 64)

    large, small = np.ptp(skin.corners.astype(int), axis=1).max(axis=1)

    assert large > 4 * small
