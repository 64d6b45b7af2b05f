"""Materials, libraries and images that a file names and does not come with."""

from __future__ import annotations

import numpy as np

from meshcone.files import MeshFile
from meshcone.notices import WarningRecord
from meshcone.options import parse_options
from meshcone.verbs.audit import audit
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import refine
from tests import shapes
from tests.whole_asset import whole

BALL = shapes.obj(*shapes.sphere(2))
RED = b"mtllib ball.mtl\nusemtl red\n" + BALL
LIBRARY = b"newmtl red\nKd 1 0 0\n"
TEXTURED = LIBRARY + b"map_Kd red.png\n"
QUICK = {"quality": {"samples": 100, "emd_samples": 16}}


def measured(source: MeshFile, reference: MeshFile) -> list[WarningRecord]:
    return measure(source, reference, parse_options({"mode": "measure", **QUICK})).warnings


def alone(source: MeshFile) -> list[WarningRecord]:
    return audit(source, None, parse_options({"mode": "audit"})).warnings


def test_a_library_that_was_not_sent_and_its_material_are_told() -> None:
    library, material = alone(MeshFile("ball.obj", RED))

    assert (library.code, library.side) == ("materials.library_missing", "source")
    assert library.words == "source ball.obj: a material library that it names was not sent with it"
    assert material.code == "materials.undefined"
    assert material.words == "source ball.obj: material 'red' is named and nowhere defined"


def test_a_name_that_no_library_has_is_told() -> None:
    text = RED.replace(b"usemtl red", b"usemtl rad")

    [material] = alone(MeshFile("ball.obj", text, {"ball.mtl": LIBRARY}))

    assert material.code == "materials.undefined"
    assert "material 'rad'" in material.words


def test_an_image_that_was_not_sent_is_told() -> None:
    [image] = alone(MeshFile("ball.obj", RED, {"ball.mtl": TEXTURED}))

    assert image.code == "textures.missing"
    assert image.words == "source ball.obj: image 'red.png' is not sent with it"


def test_what_is_all_there_draws_no_warning() -> None:
    assert alone(MeshFile("ball.obj", RED, {"ball.mtl": LIBRARY})) == []
    assert alone(MeshFile("ball.obj", BALL)) == []


def test_a_malformed_part_that_readers_tolerate_is_told_with_its_place() -> None:
    library = LIBRARY + b"Ks one two three\nKd 0 0\n"

    [found] = alone(MeshFile("ball.obj", RED, {"ball.mtl": library}))

    assert (found.code, found.where) == ("content.malformed", "ball.mtl, statement 4")
    assert "malformed and read as if absent" in found.words


def test_malformed_parts_of_a_gltf_fail_a_gate_on_warnings() -> None:
    document = whole()
    document.json["animations"][0]["channels"][0]["sampler"] = 7
    document.json["cameras"] = [3]
    asset = MeshFile("whole.gltf", document.to_bytes())
    options = parse_options({"mode": "audit", "gates": {"warnings.content": {"max": 0}}})

    report = audit(asset, None, options)

    [found] = [each for each in report.warnings if each.code == "content.malformed"]
    assert "2 parts of it are malformed" in found.words
    assert "/cameras/0" in found.words
    assert report.gates is not None
    assert report.gates.verdict == "fail"


def test_each_side_is_told_apart() -> None:
    found = measured(MeshFile("ball.obj", BALL), MeshFile("ball.obj", RED, {"ball.mtl": TEXTURED}))

    assert [(each.code, each.side) for each in found if each.code == "textures.missing"] == [
        ("textures.missing", "reference")
    ]


def test_a_refinement_tells_it_of_its_source_once() -> None:
    options = parse_options({"effort": "fast", "solver": {"certify": False}, **QUICK})

    report = refine(MeshFile("ball.obj", RED), MeshFile("ball.obj", BALL), options).report

    sides = [each.side for each in report.warnings if each.code == "materials.undefined"]
    assert sides == ["source"]


def test_stored_normals_that_point_inwards_are_told() -> None:
    vertices, faces = shapes.sphere(2, 1.0)
    turned = b"".join(b"vn %.6f %.6f %.6f\n" % tuple(-vertex) for vertex in vertices)
    corners = b"".join(
        b"f %d//%d %d//%d %d//%d\n" % tuple(np.repeat(face + 1, 2)) for face in faces
    )
    positions = b"".join(b"v %.6f %.6f %.6f\n" % tuple(vertex) for vertex in vertices)

    [found] = alone(MeshFile("ball.obj", positions + turned + corners))

    assert found.code == "normals.against_winding"
    assert "100 % of its stored normals" in found.words
