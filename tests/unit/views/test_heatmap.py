from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from meshcone.options import Options
from meshcone.verbs.measure import measurement
from meshcone.verbs.refine import Refinement, refine
from meshcone.views.heatmap import colours, heatmap_glb, scale_top
from tests import shapes

VERTICES, FACES = shapes.sphere(3)
SIZE, PLACE = 250.0, np.array([1e5, 0.0, -2e5])
CAPPED = Options.model_validate(
    {"effort": "fast", "cones": {"max_displacement": {"relative": 0.005}}}
)


def placed(vertices: NDArray[np.float64]) -> bytes:
    return shapes.obj(SIZE * vertices + PLACE, FACES)


@pytest.fixture(scope="module")
def refinement() -> Refinement:
    source = MeshFile("rough.obj", placed(shapes.noisy(VERTICES)))
    return refine(source, MeshFile("ball.obj", placed(VERTICES)), CAPPED)


@pytest.fixture(scope="module")
def heatmap(refinement: Refinement) -> bytes:
    return heatmap_glb(refinement.scene)


def attribute(glb: bytes, name: str) -> NDArray[Any]:
    document, binary = parts(glb)
    accessor = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"][name]]
    view = document["bufferViews"][accessor["bufferView"]]
    kind = {5126: "<f4", 5121: "u1"}[accessor["componentType"]]
    data = binary[view["byteOffset"] :][: view["byteLength"]]
    return np.frombuffer(data, kind).reshape(accessor["count"], -1)


def parts(glb: bytes) -> tuple[dict[str, Any], bytes]:
    length = struct.unpack_from("<I", glb, 12)[0]
    return json.loads(glb[20 : 20 + length]), glb[28 + length :]


def test_it_shows_the_refined_mesh_where_it_is(refinement: Refinement, heatmap: bytes) -> None:
    shown = read_asset("heatmap.glb", heatmap)
    refined = read_asset(refinement.name, refinement.data)

    # What single precision holds of a mesh of this size, not of coordinates so far away.
    assert np.abs(shown.vertices - refined.vertices).max() < 1e-4
    assert (shown.faces == refined.faces).all()


def test_deviations_are_in_model_units(refinement: Refinement, heatmap: bytes) -> None:
    deviation = attribute(heatmap, "_DEVIATION").ravel()
    radius, quality = refinement.report.frame.radius, refinement.report.quality

    assert quality.refined is not None
    assert refinement.scene.refined is not None
    assert radius > SIZE
    assert deviation.max() <= radius * quality.refined.point_to_surface.max * 1.001
    assert deviation == pytest.approx(radius * refinement.scene.refined.deviation, rel=1e-5)


def test_tension_is_a_second_set_of_colours(refinement: Refinement, heatmap: bytes) -> None:
    tension = attribute(heatmap, "_TENSION").ravel()

    assert refinement.scene.tension is not None
    assert tension == pytest.approx(refinement.scene.tension, rel=1e-6)
    assert len(np.unique(attribute(heatmap, "COLOR_1"), axis=0)) > 1


def test_the_scale_is_written_down(heatmap: bytes) -> None:
    extras = parts(heatmap)[0]["asset"]["extras"]
    deviation = attribute(heatmap, "_DEVIATION").ravel()

    share_within = (deviation <= extras["deviation"]["to"] * (1 + 1e-6)).mean()
    assert extras["deviation"]["unit"] == "model"
    assert 0.98 <= share_within < 1


def test_a_measured_pair_shows_its_input() -> None:
    source = MeshFile("rough.obj", placed(shapes.noisy(VERTICES)))
    measured = measurement(source, MeshFile("ball.obj", placed(VERTICES)), Options())

    attributes = parts(heatmap_glb(measured.scene))[0]["meshes"][0]["primitives"][0]["attributes"]

    assert set(attributes) == {"POSITION", "COLOR_0", "_DEVIATION"}


def test_colours_go_from_light_to_dark_and_stay_there() -> None:
    light = colours(np.array([0.0, 0.5, 1.0, 7.0]), 1.0)[:, :3].astype(int).sum(axis=1)

    assert light[0] > light[1] > light[2] == light[3]


def test_where_nothing_deviates_all_is_light() -> None:
    nothing = np.zeros(3)

    assert (colours(nothing, scale_top(nothing)) == colours(np.zeros(1), 1.0)).all()
