"""Assets that are spoiled while their surface is sound fail, by built-in and example gates."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.gates.files import parse_gate_file
from meshcone.gates.fitting import require_known
from meshcone.gates.judge import judge
from meshcone.gates.keep import KEPT, keep_gates
from meshcone.options import parse_options
from meshcone.report.report import MeasureReport
from meshcone.verbs.audit import audit
from meshcone.verbs.measure import measure
from tests import shapes
from tests.whole_asset import Document, png, square, whole

GATES = (Path(__file__).parents[3] / "docs" / "gates.md").read_text()
EXAMPLE = re.search(r"```toml\n(.*?)```", GATES, re.DOTALL)
FEW: dict[str, Any] = {
    "keep": ["all"],
    "quality": {"samples": 200, "emd_samples": 16, "curvature_samples": 16},
}
Damage = Callable[[Document], object]


def measured(source: MeshFile, reference: MeshFile) -> MeasureReport:
    return measure(source, reference, parse_options(FEW))


def gltf(document: Document) -> MeshFile:
    return MeshFile("a.gltf", document.to_bytes())


def example_fails(report: MeasureReport) -> bool:
    assert EXAMPLE is not None
    gates = parse_gate_file("gates.toml", EXAMPLE[1].encode(), "measure").for_asset("a.gltf")
    return judge(report, gates).verdict == "fail"


def primitives(document: Document) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = document.json["meshes"][0]["primitives"]
    return found


def without_attribute(name: str) -> Damage:
    return lambda document: [each["attributes"].pop(name) for each in primitives(document)]


def with_attribute(name: str, change: Callable[[Any], Any]) -> Damage:
    def damage(document: Document) -> None:
        accessor = document.accessor(change(square()[name]).astype("<f4"))
        for primitive in primitives(document):
            primitive["attributes"][name] = accessor

    return damage


def flipped_winding(document: Document) -> None:
    indices = document.accessor(np.array([[0, 2, 1, 0, 3, 2]], dtype="<u2").reshape(-1, 1))
    for primitive in primitives(document):
        primitive["indices"] = indices


def magenta(document: Document) -> None:
    document.json["images"][0]["bufferView"] = document.view(png((255, 0, 255), 2, 2))


def without_textures(document: Document) -> None:
    for name in ("textures", "images", "samplers"):
        del document.json[name]
    del document.json["materials"][0]["normalTexture"]
    del document.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]


def merged_materials(document: Document) -> None:
    document.json["materials"].pop()
    primitives(document)[1]["material"] = 0


def recoloured(document: Document) -> None:
    document.json["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"] = [0, 1, 0, 0.5]


def flattened(document: Document) -> None:
    document.json["nodes"] = [{"mesh": 0, "translation": [0, 1, 0]}]
    del document.json["animations"], document.json["skins"]


def without_animation(document: Document) -> None:
    del document.json["animations"]


SPOILED: dict[str, Damage] = {
    "winding flipped": flipped_winding,
    "coordinates lost": without_attribute("TEXCOORD_0"),
    "coordinates scrambled": with_attribute("TEXCOORD_0", lambda uv: uv[[0, 2, 1, 3]] * (0.3, 1)),
    "coordinates upside down": with_attribute("TEXCOORD_0", lambda uv: uv * (1, -1) + (0, 1)),
    "textures lost": without_textures,
    "texture replaced": magenta,
    "material renamed": lambda document: document.json["materials"][0].update(name="lambert1"),
    "materials merged": merged_materials,
    "material recoloured": recoloured,
    "animation dropped": without_animation,
    "hierarchy flattened": flattened,
    "normals inverted": with_attribute("NORMAL", lambda normals: -normals),
    "normals lost": without_attribute("NORMAL"),
    "part missing": lambda document: primitives(document).pop(),
}


@pytest.mark.parametrize("name", SPOILED)
def test_a_spoiled_gltf_fails(name: str) -> None:
    document = whole()
    SPOILED[name](document)

    report = measured(gltf(document), gltf(whole()))

    assert report.gates is not None
    assert report.gates.verdict == "fail"
    assert example_fails(report)


LIBRARY = b"newmtl wood\nKd 0.6 0.3 0.1\nnewmtl iron\nKd 0.4 0.4 0.5\n"


def textured_obj(*, texcoords: bool = True, name: str = "wood") -> bytes:
    """A ball with coordinates and two materials."""
    vertices, faces = shapes.sphere(1)
    corners = [f"{v}/{v}" if texcoords else f"{v}" for v in range(1, len(vertices) + 1)]
    lines = ["mtllib a.mtl", *(f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist())]
    if texcoords:
        lines += [f"vt {x / 4 + 0.5!r} {y / 4 + 0.5!r}" for x, y, _ in vertices.tolist()]
    half = len(faces) // 2
    for material, part in ((name, faces[:half]), ("iron", faces[half:])):
        lines += [f"usemtl {material}"]
        lines += [f"f {' '.join(corners[v] for v in face)}" for face in part.tolist()]
    return "\n".join(lines).encode() + b"\n"


@pytest.mark.parametrize(
    ("data", "resources"),
    [
        (textured_obj(texcoords=False), {"a.mtl": LIBRARY}),
        (textured_obj(), {}),
        (textured_obj(name="iron"), {"a.mtl": LIBRARY}),
        (textured_obj(), {"a.mtl": LIBRARY.replace(b"0.6 0.3 0.1", b"0.1 0.3 0.6")}),
    ],
    ids=["coordinates lost", "library lost", "materials merged", "material recoloured"],
)
def test_a_spoiled_obj_fails(data: bytes, resources: dict[str, bytes]) -> None:
    reference = MeshFile("b.obj", textured_obj(), {"a.mtl": LIBRARY})

    report = measured(MeshFile("a.obj", data, resources), reference)

    assert report.gates is not None
    assert report.gates.verdict == "fail"
    assert example_fails(report)


def test_a_material_changed_after_a_number_sign_fails() -> None:
    library = LIBRARY.replace(b"wood", b"Mat #1").replace(b"iron", b"Mat #2")
    data = textured_obj(name="Mat #1").replace(b"iron", b"Mat #2")
    repainted = library.replace(b"0.4 0.4 0.5", b"0.9 0.1 0.1")

    report = measured(
        MeshFile("a.obj", data, {"a.mtl": repainted}), MeshFile("b.obj", data, {"a.mtl": library})
    )

    assert report.gates is not None
    assert report.gates.verdict == "fail"
    assert example_fails(report)


def test_a_copy_passes_in_another_order_and_with_another_name() -> None:
    document = whole()
    reordered = Document()
    reordered.json, reordered._buffer = json.loads(json.dumps(document.json)), document._buffer
    primitives(reordered).reverse()

    report = measured(MeshFile("b.gltf", reordered.to_bytes()), gltf(document))

    assert report.gates is not None
    assert [check.words for check in report.gates.checks if check.status != "pass"] == []


def test_another_triangulation_with_its_coordinates_keeps_them() -> None:
    vertices, faces = shapes.sphere(2)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"vt {x / 4 + 0.5!r} {y / 4 + 0.5!r}" for x, y, _ in vertices.tolist()]
    half = len(faces) // 2
    for material, part in (("wood", faces[:half]), ("iron", faces[half:])):
        lines += [f"usemtl {material}"]
        lines += [f"f {' '.join(f'{v}/{v}' for v in face)}" for face in (part + 1).tolist()]
    finer = "\n".join(["mtllib a.mtl", *lines]).encode() + b"\n"
    resources = {"a.mtl": LIBRARY}

    report = audit(
        MeshFile("b.obj", finer, resources),
        MeshFile("a.obj", textured_obj(), resources),
        parse_options({"mode": "audit", "keep": ["uvs", "materials"]}),
    )

    assert report.gates is not None
    assert [check.words for check in report.gates.checks if check.status != "pass"] == []


@pytest.mark.parametrize("what", KEPT)
def test_every_set_is_of_gates_that_measurements_and_audits_have(what: str) -> None:
    gates = keep_gates([what])

    assert gates
    require_known(gates, "measure")
    require_known(gates, "audit")


def test_keeping_needs_a_reference() -> None:
    with pytest.raises(InputError, match="'keep' is about a reference"):
        audit(gltf(whole()), None, parse_options({"mode": "audit", "keep": ["uvs"]}))


def test_normals_are_not_kept_where_another_shape_lies_elsewhere() -> None:
    """Nothing of it is close enough to the reference to compare normals with."""
    vertices, faces = shapes.sphere(2)
    ball = MeshFile("ball.obj", shapes.obj(vertices, faces))
    corner = vertices * [3.0, 1.0, 0.5] + 0.3 * vertices**2 + [20.0, 0.0, 0.0]
    inside_out = MeshFile("other.obj", shapes.obj(corner, faces[:, ::-1]))

    report = measure(inside_out, ball, parse_options({**FEW, "keep": ["normals"]}))

    assert {each.code for each in report.warnings} >= {"pose.apart"}
    assert report.gates is not None
    assert report.gates.verdict == "not_tested"
    [opposed] = [each for each in report.gates.checks if each.key == "warnings.normals.opposed"]
    assert opposed.status == "not_tested"


@pytest.mark.parametrize("kept", ["textures", "all"])
def test_images_that_were_not_sent_are_not_kept(kept: str) -> None:
    document = whole()
    document.json["images"][0] = {"uri": "wood.png"}

    report = audit(gltf(document), gltf(document), parse_options({"mode": "audit", "keep": [kept]}))

    assert report.gates is not None
    assert report.gates.verdict == "not_tested"
    assert (
        "changes.lost.images: not tested, because an image that both files name was not sent"
        in [check.words for check in report.gates.checks]
    )
