"""Refining with faces added where the source has too few."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.errors import InputError, LimitError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.options.detail import DetailOptions
from meshcone.surface import Mesh
from meshcone.verbs.refine import Refinement, refine
from meshcone.verbs.verify import verify
from meshcone.verbs.within import refine_within
from tests import shapes
from tests.unit.assets.bisecting import bisected
from tests.unit.assets.builders import Gltf, chunks, compress, cube_gltf
from tests.unit.assets.plain_gltf import corners
from tests.unit.assets.squeezing import squeezed

FEW: dict[str, Any] = {"samples": 500, "emd_samples": 16, "curvature_samples": 16}
QUICK: dict[str, Any] = {"effort": "fast", "quality": FEW, "deviation": {"prove": False}}


def ball(level: int, name: str = "ball.obj") -> MeshFile:
    return MeshFile(name, shapes.obj(*shapes.sphere(level)))


def refined(source: MeshFile, **options: Any) -> Refinement:
    return refine(source, ball(4), parse_options({**QUICK, **options}))


def test_faces_are_added_and_the_surface_comes_closer() -> None:
    plain, found = refined(ball(2)), refined(ball(2), detail={"growth": 4})
    told = found.report.detail
    assert (told.faces_before, told.stopped) == (128, "budget")
    assert 500 <= told.faces_after <= 512
    assert told.faces_after == len(read_asset("r.obj", found.data).faces)
    mean, without = (each.report.quality.refined.point_to_surface.mean for each in (found, plain))
    assert mean < without / 3


def test_the_report_is_still_of_the_file_that_was_sent() -> None:
    sent = ball(2)
    report = refined(sent, detail={"growth": 2}).report
    assert report.inputs.source.sha256 == sent.sha256
    assert report.inputs.source.faces == 128
    assert report.asset.refined.budget.triangles > report.asset.source.budget.triangles == 128


def test_it_verifies_like_any_other() -> None:
    sent, options = (
        ball(2),
        parse_options({"effort": "fast", "quality": FEW, "detail": {"growth": 2}}),
    )
    found = refine(sent, ball(4), options)
    certificate = MeshFile("r.certificate.npz", found.certificate)
    refined_file = MeshFile(found.name, found.data)
    checks = verify(found.report, certificate, sent, ball(4), refined_file)
    assert [check.words for check in checks.checks if not check.ok] == []
    assert "division" in {check.name for check in checks.checks}


@pytest.mark.parametrize("effort", ["fast", "best"])
def test_a_glb_gets_faces_and_verifies(effort: str) -> None:
    sent = MeshFile("ball.glb", shapes.glb(*shapes.sphere(2)))
    options = {"effort": effort, "quality": FEW, "detail": {"growth": 3}}
    found = refine(sent, ball(4), parse_options(options))
    certificate = MeshFile("r.certificate.npz", found.certificate)
    checks = verify(found.report, certificate, sent, ball(4), MeshFile(found.name, found.data))
    assert [check.words for check in checks.checks if not check.ok] == []
    before, after = (
        getattr(found.report.quality, which).point_to_surface.mean for which in ("input", "refined")
    )
    assert after < before / 3


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_mesh_drawn_twice_stays_one_mesh(mirrored: bool) -> None:
    """Both places agree on where the reference is, and on all that follows from it."""
    gltf = Gltf()
    vertices, faces = shapes.sphere(2)
    primitive = {
        "attributes": {"POSITION": gltf.accessor(vertices.astype(np.float32))},
        "indices": gltf.accessor(faces.astype(np.uint16).reshape(-1)),
    }
    mesh = gltf.mesh(primitive)
    gltf.node(mesh=mesh)
    gltf.node(mesh=mesh, translation=[5, 0, 0], scale=[-1 if mirrored else 1, 1, 1])
    fine, many = shapes.sphere(4)
    both = np.concatenate([fine, fine + np.array([5.0, 0, 0])])
    reference = MeshFile("two.obj", shapes.obj(both, np.concatenate([many, many + len(fine)])))
    sent = MeshFile("two.glb", gltf.glb())
    found = refine(sent, reference, parse_options({**QUICK, "detail": {"growth": 2}}))
    document, _ = chunks(found.data)
    told = found.report.detail
    assert told.divided > 0
    assert told.faces_after <= 512
    drawn = document["meshes"][document["nodes"][0]["mesh"]]["primitives"][0]
    assert 2 * document["accessors"][drawn["indices"]]["count"] == 3 * told.faces_after
    asset = read_asset("r.glb", found.data)
    assert not Mesh(asset.vertices, asset.faces).border_sides.any()


def test_without_the_option_nothing_is_added_or_said() -> None:
    assert refined(ball(2)).report.detail is None
    asked = refined(ball(2), detail={"growth": 1, "tolerance": 0.01})
    assert asked.data == refined(ball(2)).data


def test_what_follows_its_reference_already_gets_no_faces() -> None:
    told = refined(ball(4), detail={"growth": 2}).report.detail
    assert (told.faces_after, told.divided, told.levels) == (told.faces_before, 0, 0)
    assert told.stopped == "tolerance"


def test_a_tolerance_takes_as_many_faces_as_it_needs() -> None:
    """The chords of a ball are off by the square of their length: a fourth of it, four times."""
    fine, finer = (
        refined(ball(2), detail={"growth": 64, "tolerance": t}).report for t in (0.02, 0.005)
    )
    assert fine.detail.stopped == finer.detail.stopped == "tolerance"
    assert 128 < fine.detail.faces_after < finer.detail.faces_after < 64 * 128
    assert finer.quality.refined.point_to_surface.max < 0.005


def test_a_tolerance_to_be_proven_is_reached_by_faces() -> None:
    options = {"effort": "fast", "quality": FEW, "within": "0.5%", "detail": {"growth": 16}}
    without = refine_within(ball(2), ball(4), parse_options({**options, "detail": {"growth": 1}}))
    assert not without.report.within.reached
    found = refine_within(ball(2), ball(4), parse_options(options))
    assert found.report.within.reached
    assert found.report.detail.faces_after > 128


def test_what_is_not_selected_keeps_its_faces_and_places() -> None:
    vertices, faces = shapes.sphere(2)
    north = vertices[faces].mean(axis=1)[:, 2] > 0
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    for group, rows in (("north", faces[north]), ("south", faces[~north])):
        lines += [f"g {group}", *(f"f {a} {b} {c}" for a, b, c in rows + 1)]
    source = MeshFile("halves.obj", "\n".join(lines).encode())
    found = refined(source, detail={"growth": 2}, select={"groups": ["north"]})
    assert found.report.detail.divided > 0
    asset = read_asset("r.obj", found.data)
    names, parts = asset.parts("group")
    south = asset.vertices[asset.faces[parts == names.index("south")]]
    assert np.array_equal(south, vertices[faces[~north]])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"formulation": "centroid"}, "surface formulation"),
        ({"cones": {"pin": {"vertices": [0]}}}, "pinned by their numbers"),
    ],
)
def test_what_knows_no_added_faces_is_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        refined(ball(1), detail={"growth": 2}, **options)


@pytest.mark.parametrize(
    ("option", "squeeze"), [("draco", compress), ("meshopt", squeezed)], ids=["draco", "meshopt"]
)
def test_what_is_to_be_compressed_again_is_refused(
    option: str, squeeze: Callable[[Gltf], Gltf]
) -> None:
    source = MeshFile("cube.glb", squeeze(cube_gltf()).glb())

    with pytest.raises(InputError, match=f"set {option}=plain"):
        refined(source, detail={"growth": 2}, **{option: "encode"})


def test_a_ply_a_colour_and_all_is_divided_and_proven() -> None:
    text = ball(1).data.decode().split("\n")
    points = [line.split()[1:4] for line in text if line.startswith("v ")]
    faces = [
        [int(word.split("/")[0]) - 1 for word in line.split()[1:]]
        for line in text
        if line.startswith("f ")
    ]
    rows = [" ".join([*point, str(20 * (number % 10))]) for number, point in enumerate(points)]
    rows += [" ".join(map(str, [len(face), *face])) for face in faces]
    head = (
        f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\n"
        f"property float y\nproperty float z\nproperty uchar red\nelement face {len(faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    found = refined(
        MeshFile("a.ply", (head + "\n".join(rows) + "\n").encode()),
        detail={"growth": 2, "flips": "chart"},
    )
    told = found.report.detail
    assert told is not None
    assert told.faces_after > told.faces_before == len(faces)
    assert b"element face %d\n" % told.faces_after in found.data


def test_more_faces_than_are_accepted_are_refused() -> None:
    with pytest.raises(LimitError, match="MESHCONE_LIMIT_FACES"):
        refined(ball(1), detail={"max_faces": 50_000_000})


def test_borders_that_are_pinned_are_divided_and_stay() -> None:
    cut = shapes.sphere(2)
    upper = cut[1][cut[0][cut[1]].mean(axis=1)[:, 2] > 0]
    source = MeshFile("cup.obj", shapes.obj(cut[0], upper))
    found = refined(source, detail={"growth": 4}, cones={"pin": {"boundary": True}})
    asset = read_asset("r.obj", found.data)
    rim = asset.vertices[np.abs(asset.vertices[:, 2]) < 1e-4]
    assert len(rim) > 16
    assert np.linalg.norm(rim, axis=1).min() < 1.99  # on the chords, where the reference is not


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("4x", {"growth": 4.0}),
        ("1.5x", {"growth": 1.5}),
        (" 20000 ", {"max_faces": 20000}),
        ("auto", {"growth": 16.0}),
    ],
)
def test_an_amount_of_detail_is_read(text: str, options: dict[str, Any]) -> None:
    assert DetailOptions.asked(text) == options


@pytest.mark.parametrize("text", ["", "x", "-1x", "4 x", "lots", "1e9", "4xx"])
def test_what_is_no_amount_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="not an amount of detail"):
        DetailOptions.asked(text)


def test_a_proof_that_fails_is_tried_again_with_a_smaller_aim() -> None:
    options = {"effort": "fast", "quality": FEW, "within": "0.3%", "detail": {"growth": 40}}
    found = refine_within(ball(2), ball(4), parse_options(options)).report
    assert found.within.reached
    assert found.within.attempts == 2
    assert found.options.detail.tolerance == pytest.approx(0.6 * 0.003)


def test_joints_move_new_vertices_as_they_move_the_faces_they_lie_on() -> None:
    """Where the vertices of a face follow the same joints, in ten poses."""
    vertices, faces = shapes.sphere(2)
    gltf = Gltf()
    bones = np.tile(np.array([[0, 1, 0, 0]], dtype=np.uint8), (len(vertices), 1))
    weights = np.tile(np.array([[0.25, 0.75, 0, 0]], dtype=np.float32), (len(vertices), 1))
    attributes = {
        "POSITION": gltf.accessor(vertices.astype(np.float32)),
        "JOINTS_0": gltf.accessor(bones),
        "WEIGHTS_0": gltf.accessor(weights),
    }
    indices = gltf.accessor(faces.astype(np.uint16).reshape(-1))
    gltf.node(mesh=gltf.mesh({"attributes": attributes, "indices": indices}), skin=0)
    gltf.json["skins"] = [{"joints": [gltf.node(), gltf.node()]}]
    before = gltf.glb()
    asset = read_asset("a.glb", before)
    subdivision = bisected(asset.faces, [0, 40, 81, 7])
    after = asset.divided(subdivision)
    shares = subdivision.corners / 2.0**subdivision.exponent
    generator = np.random.default_rng(3)
    for _ in range(10):
        pose = generator.normal(size=(2, 4, 3))
        expected = np.einsum("fij,fjc->fic", shares, posed(before, pose)[subdivision.parents])
        assert posed(after, pose) == pytest.approx(expected, abs=1e-6 * np.abs(pose).max() * 8)


def posed(glb: bytes, pose: np.ndarray) -> np.ndarray:
    """(k, 3, 3) corners where two joints' affine maps (2, 4, 3) take them."""
    places = corners(glb, "POSITION")
    homogeneous = np.concatenate([places, np.ones((*places.shape[:2], 1))], axis=2)
    maps = pose[corners(glb, "JOINTS_0").astype(int)]
    blended = np.einsum("fcj,fcjab->fcab", corners(glb, "WEIGHTS_0"), maps)
    return np.einsum("fca,fcab->fcb", homogeneous, blended)
