from __future__ import annotations

import io
import json
import struct
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from meshcone.options import Options, parse_options
from meshcone.quality.parts import Partition
from meshcone.verbs.measure import measurement
from meshcone.verbs.refine import Refinement, refine
from meshcone.views.light import simplified
from meshcone.views.preview import preview_glb
from tests import shapes
from tests.painted import encoded, globe, painted, picture
from tests.truck import WHEELS, truck_mesh, truck_obj

FINE = shapes.sphere(5)
CAPPED = Options.model_validate(
    {"effort": "fast", "cones": {"max_displacement": {"relative": 0.005}}}
)
QUICK = parse_options(
    {
        "mode": "measure",
        "quality": {"emd_samples": 16, "curvature_samples": 16},
        "deviation": {"prove": False},
    }
)


def read_glb(glb: bytes) -> tuple[dict[str, Any], bytes]:
    length = struct.unpack_from("<I", glb, 12)[0]
    return json.loads(glb[20 : 20 + length]), glb[28 + length :]


def accessor(document: dict[str, Any], binary: bytes, number: int) -> NDArray[Any]:
    """The rows of an accessor, of numbers that follow each other."""
    stored = document["accessors"][number]
    view = document["bufferViews"][stored["bufferView"]]
    kind = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[stored["componentType"]]
    data = binary[view["byteOffset"] :][: view["byteLength"]]
    return np.frombuffer(data, kind).reshape(stored["count"], -1)


def surface_of(glb: bytes, name: str) -> dict[str, NDArray[Any]]:
    """Attributes and indices of one of the meshes of a preview; plain numbers are flat."""
    document, binary = read_glb(glb)
    mesh = next(mesh for mesh in document["meshes"] if mesh["name"] == name)
    [primitive] = mesh["primitives"]
    numbers = {**primitive["attributes"], "indices": primitive["indices"]}
    rows = {key: accessor(document, binary, number) for key, number in numbers.items()}
    return {key: each.ravel() if each.shape[1] == 1 else each for key, each in rows.items()}


@pytest.fixture(scope="module")
def refinement() -> Refinement:
    vertices, faces = FINE
    source = MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces))
    return refine(source, MeshFile("ball.obj", shapes.obj(vertices, faces)), CAPPED)


def test_a_scene_shows_the_distances_the_report_states(refinement: Refinement) -> None:
    scene, quality = refinement.scene, refinement.report.quality

    assert scene.refined is not None
    assert scene.input.deviation.max() <= quality.input.point_to_surface.max
    assert scene.refined.deviation.mean() < 0.9 * scene.input.deviation.mean()
    assert len(scene.reference.deviation) == len(scene.reference.mesh.vertices)


def test_tension_is_where_cones_are_active(refinement: Refinement) -> None:
    assert refinement.report.certificate is not None
    assert sum(refinement.report.certificate.active.values()) > 0
    assert refinement.scene.tension is not None
    assert refinement.scene.tension.max() > 0


def test_simplified_meshes_keep_shape_and_common_faces(refinement: Refinement) -> None:
    light = simplified(refinement.scene, 2_000).scene

    assert light.refined is not None
    assert len(light.refined.mesh.faces) <= 2_000
    assert (light.refined.mesh.faces == light.input.mesh.faces).all()
    assert np.abs(np.linalg.norm(light.reference.mesh.vertices, axis=1) - 1).max() < 0.01


def test_simplifying_lets_no_deviation_disappear(refinement: Refinement) -> None:
    scene = refinement.scene
    light = simplified(scene, 2_000).scene

    assert light.input.deviation.max() == scene.input.deviation.max()
    assert light.tension is not None
    assert scene.tension is not None
    assert light.tension.max() == scene.tension.max()


def test_a_preview_is_a_glb_that_readers_understand(refinement: Refinement) -> None:
    asset = read_asset("preview.glb", preview_glb(refinement.scene))

    assert asset.counts().faces == 3 * len(FINE[1])
    assert np.abs(asset.vertices).max() < 1.2


def test_a_small_mesh_is_shown_as_it_is(refinement: Refinement) -> None:
    assert simplified(refinement.scene, 100_000).scene.input is refinement.scene.input


def test_a_measurement_has_no_refined_mesh_to_show() -> None:
    vertices, faces = shapes.sphere(2)
    source = MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces))

    scene = measurement(source, MeshFile("b.obj", shapes.obj(vertices, faces)), Options()).scene

    assert scene.refined is None
    assert scene.input.deviation.max() > 0


def test_a_point_inside_the_reference_has_a_negative_distance() -> None:
    vertices, faces = shapes.sphere(2)
    ball = MeshFile("ball.obj", shapes.obj(vertices, faces))
    halves = np.where(vertices[:, :1] > 0, 0.9, 1.1)
    source = MeshFile("egg.obj", shapes.obj(halves * vertices, faces))

    glb = preview_glb(measurement(source, ball, Options()).scene)

    surface = surface_of(glb, "input")
    inside = surface["POSITION"][:, 0] > 0.05
    outside = surface["POSITION"][:, 0] < -0.05
    assert (surface["_SIGNED"][inside] < 0).all()
    assert (surface["_SIGNED"][outside] > 0).all()
    assert np.abs(surface["_SIGNED"]) == pytest.approx(surface["_DEVIATION"])


def test_the_triangles_of_a_part_stand_together_under_its_name() -> None:
    options = parse_options({"mode": "measure", "quality": {"per": "node"}})
    source = MeshFile("truck.obj", truck_obj())
    preview = preview_glb(measurement(source, source, options).scene)

    document, _ = read_glb(preview)
    surface = surface_of(preview, "reference")
    parts = next(mesh for mesh in document["meshes"] if mesh["name"] == "reference")["extras"]
    assert [part["name"] for part in parts["parts"]] == ["body", *WHEELS]
    frame = document["asset"]["extras"]
    for part in parts["parts"]:
        of_part = slice(3 * part["first"], 3 * (part["first"] + part["count"]))
        corners = surface["POSITION"][surface["indices"][of_part].ravel()]
        expected = truck_mesh(part["name"]).vertices
        model = corners * frame["radius"] + frame["centre"]
        assert model.min(axis=0) == pytest.approx(expected.min(axis=0), abs=1e-6)
        assert model.max(axis=0) == pytest.approx(expected.max(axis=0), abs=1e-6)


def test_parts_of_a_simplified_surface_stay_apart() -> None:
    vertices, faces = FINE
    upper = vertices[faces].mean(axis=1)[:, 2] > 0
    halves = Partition(("lower", "upper"), upper.astype(np.int64))
    ball = MeshFile("ball.obj", shapes.obj(vertices, faces))
    scene = replace(measurement(ball, ball, Options()).scene, parts=(halves, halves))

    light = simplified(scene, 2_000).scene

    assert light.parts is not None
    centres = light.input.mesh.corners.mean(axis=1)[:, 2]
    labels = light.parts[0].labels
    assert (labels[centres > 0.1] == 1).all()
    assert (labels[centres < -0.1] == 0).all()


def test_a_textured_surface_has_its_colours_and_coordinates_at_every_corner() -> None:
    arrays = globe(16, 8)
    file = MeshFile("globe.gltf", painted(encoded(picture()), arrays))
    preview = preview_glb(measurement(file, file, Options()).scene, 20_000)

    document, binary = read_glb(preview)
    extras = document["meshes"][0]["extras"]
    corners = accessor(document, binary, extras["skin"]["corners"])
    steps = accessor(document, binary, extras["uv"]["corners"])
    image = document["bufferViews"][document["images"][0]["bufferView"]]
    jpeg = binary[image["byteOffset"] :][: image["byteLength"]]

    assert Image.open(io.BytesIO(jpeg)).size == (extras["skin"]["side"],) * 2
    assert len(corners) == len(steps) == len(surface_of(preview, "input")["indices"].ravel())
    low, high = np.array(extras["uv"]["low"]), np.array(extras["uv"]["high"])
    written = low + steps / 65535 * (high - low)
    places = arrays["POSITION"][arrays["faces"]]
    drawn = [len(np.unique(corners, axis=0)) == 3 for corners in places]  # not those at the poles
    expected = arrays["TEXCOORD_0"][arrays["faces"][drawn].ravel()]
    assert written == pytest.approx(expected, abs=1e-4)


def test_there_is_room_for_the_colours_of_as_many_triangles_as_a_preview_has() -> None:
    arrays = globe(64, 24)
    file = MeshFile("globe.gltf", painted(encoded(picture()), arrays))
    scene = measurement(file, file, Options()).scene

    document, binary = read_glb(preview_glb(scene, len(arrays["faces"])))

    skin = document["meshes"][0]["extras"]["skin"]
    corners = accessor(document, binary, skin["corners"])
    assert len(corners) == 3 * len(scene.input.mesh.faces)
    assert 8 * len(scene.input.mesh.faces) <= skin["side"] ** 2
    assert corners.max() < skin["side"]


def test_a_simplified_surface_keeps_its_texture_in_place_and_its_seam_closed() -> None:
    file = MeshFile("globe.gltf", painted(encoded(picture()), globe(96, 48)))
    scene = measurement(file, file, QUICK).scene

    preview = preview_glb(scene, 3_000)

    surface = surface_of(preview, "reference")
    document, binary = read_glb(preview)
    uv = next(m for m in document["meshes"] if m["name"] == "reference")["extras"]["uv"]
    low, high = np.array(uv["low"]), np.array(uv["high"])
    written = low + accessor(document, binary, uv["corners"]) / 65535 * (high - low)
    triangles = written.reshape(-1, 3, 2)
    assert 1_000 < len(triangles) <= 3_000
    points = surface["POSITION"][surface["indices"]]
    x, y, z = points.T / np.linalg.norm(points, axis=1)
    # A triangle over the seam would reach from one end of the texture to the other.
    belt = (np.abs(y.reshape(-1, 3)) < 0.8).all(axis=1)
    assert np.ptp(triangles[belt, :, 0], axis=1).max() < 0.3
    south = np.arccos(np.clip(y, -1, 1)) / np.pi
    assert np.abs(written[:, 1] - south).max() < 0.03
    away = np.abs(y) < 0.9  # towards the poles, east and west come together
    east = np.arctan2(-z, x) / (2 * np.pi)
    turned = (written[:, 0] - east + 0.5) % 1 - 0.5
    assert np.abs(turned[away]).max() < 0.03


def contrast_in(preview: bytes, name: str) -> tuple[NDArray[Any], dict[str, Any]] | None:
    """CIEDE2000 at the corners of the triangles of a mesh, and what the file says of them."""
    document, binary = read_glb(preview)
    extras = next(mesh for mesh in document["meshes"] if mesh["name"] == name)["extras"]
    if "contrast" not in extras:
        return None
    said = extras["contrast"]
    view = document["bufferViews"][document["images"][said["image"]]["bufferView"]]
    image = Image.open(io.BytesIO(binary[view["byteOffset"] :][: view["byteLength"]]))
    columns, rows = accessor(document, binary, said["corners"]).T
    return np.asarray(image)[rows, columns] * (said["top"] / 255), said


@pytest.mark.parametrize("most", [100_000, 500])
def test_a_recoloured_half_differs_and_the_other_does_not(most: int) -> None:
    image = picture()
    changed = image.copy()
    changed[:, : image.shape[1] // 2] = 255 - image[:, : image.shape[1] // 2]
    files = [
        MeshFile("globe.gltf", painted(encoded(each), globe(64, 32))) for each in (changed, image)
    ]
    done = measurement(*files, QUICK)

    preview = preview_glb(done.scene, most)

    found = contrast_in(preview, "input")
    assert found is not None
    values, said = found
    assert contrast_in(preview, "reference") is None
    surface = surface_of(preview, "input")
    centres = surface["POSITION"][surface["indices"]].reshape(-1, 3, 3).mean(axis=1)
    by_face = values.reshape(-1, 3).mean(axis=1)
    east = np.arctan2(-centres[:, 2], centres[:, 0])
    recoloured, same = east > 0.6, east < -0.6
    near = (np.abs(east) < 2.5) & (np.abs(centres[:, 1]) < 0.8)
    assert by_face[recoloured & near].min() > 5
    assert by_face[same & near].max() < 2
    appearance = done.report.appearance
    assert appearance is not None
    assert not isinstance(appearance.color_difference, str)
    assert said["top"] == pytest.approx(appearance.color_difference.max, rel=0.25)


def test_colours_that_only_the_source_has_are_compared_with_nothing() -> None:
    vertices, faces = shapes.sphere(2)
    coloured = MeshFile("globe.gltf", painted(encoded(picture())))
    plain = MeshFile("ball.obj", shapes.obj(vertices, faces))

    scene = measurement(coloured, plain, QUICK).scene

    assert contrast_in(preview_glb(scene), "input") is None
