"""Files of design programs, as references."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meshcone.assets import Limits, read_asset
from meshcone.assets.policy import ReadPolicy
from meshcone.errors import InputError, LimitError
from meshcone.notices import Code
from tests import shapes
from tests.archives import packed
from tests.cad import QUAD, step_ball, three_mf, usda, usdz

TETRAHEDRON = (
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
)


@pytest.mark.parametrize(("chord", "most"), [(None, 30_000), (0.5, 1_000)])
def test_a_step_is_divided_within_the_chord_that_is_stated(chord: float | None, most: int) -> None:
    asset = read_asset("ball.step", step_ball(20.0), policy=ReadPolicy(chord=chord))

    corners = asset.vertices[asset.faces]
    weights = np.random.default_rng(0).dirichlet(np.ones(3), size=(20, 1))
    inside = np.linalg.norm((weights[..., None] * corners).sum(axis=-2), axis=-1)
    assert asset.tolerance == pytest.approx(chord or 0.0158, rel=0.01)
    assert np.abs(inside - 20).max() <= asset.tolerance
    assert len(corners) <= most
    [notice] = asset.warnings
    assert notice.code == Code.SURFACE_TESSELLATED


def test_a_step_is_in_millimetres_whatever_its_unit() -> None:
    asset = read_asset("ball", step_ball(2.0, inches=True))

    assert asset.format == "step"
    assert np.linalg.norm(asset.vertices, axis=1).max() == pytest.approx(50.8, rel=1e-6)


def test_a_3mf_is_read_where_its_items_put_its_objects() -> None:
    place = "0 2 0 -2 0 0 0 0 2 10 20 30"  # twice the size, turned by 90 degrees about z

    asset = read_asset("two.3mf", three_mf([TETRAHEDRON], [(1, None), (1, place)]))

    there = np.array([[10, 20, 30], [10, 22, 30], [8, 20, 30], [10, 20, 32]])
    assert (asset.format, asset.media_type) == ("3mf", "model/3mf")
    assert np.allclose(asset.vertices, np.concatenate([TETRAHEDRON[0], there]))
    assert asset.tolerance == 0
    assert asset.parts("node")[1].tolist() == [0, 0, 0, 0, 1, 1, 1, 1]


TURNED = np.array([[0, 0, 0], [1, 0, 0], [1, 0, -1], [0, 0, -1]])
FLAT = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
ALONG = np.array([10, 0, 0])


@pytest.mark.parametrize(
    ("metadata", "there"),
    [
        ("", FLAT + ALONG),
        ("metersPerUnit = 0.01", (FLAT + ALONG) / 100),
        ('upAxis = "Z"', TURNED + ALONG),
        ('upAxis = "Y"\nmetersPerUnit = 1', FLAT + ALONG),
    ],
)
def test_a_usd_is_read_in_the_unit_and_with_the_axis_that_it_names(
    metadata: str, there: np.ndarray
) -> None:
    asset = read_asset("quad.usda", usda(QUAD, metadata=metadata))

    assert asset.format == "usd"
    assert np.allclose(asset.vertices, there)
    assert asset.faces.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("kind", ["usdc", "usdz"])
def test_a_usd_may_be_binary_or_packed(kind: str, tmp_path: Path) -> None:
    from pxr import Usd, UsdUtils

    text = tmp_path / "quad.usda"
    text.write_bytes(usda(QUAD))
    made = tmp_path / "quad.usdc"
    assert Usd.Stage.Open(str(text)).Export(str(made))
    if kind == "usdz":
        made = tmp_path / "quad.usdz"
        assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "quad.usdc"), str(made))

    asset = read_asset(made.name, made.read_bytes())

    assert np.allclose(asset.vertices, FLAT + ALONG)


def test_what_a_usd_hides_is_not_read() -> None:
    hidden = QUAD.replace('"quad"', '"hidden"').replace("{", '{\ntoken visibility = "invisible"')
    guide = QUAD.replace('"quad"', '"guide"').replace("{", '{\nuniform token purpose = "guide"')

    assert len(read_asset("a", usda(QUAD, hidden, guide)).faces) == 2


def test_a_usd_mesh_that_is_left_handed_faces_the_other_way() -> None:
    turned = QUAD.replace("{", '{\nuniform token orientation = "leftHanded"')

    assert read_asset("a", usda(turned)).faces.tolist() == [[2, 1, 0], [3, 2, 0]]


def test_a_usd_may_refer_to_prims_of_its_own() -> None:
    again = 'def "again" (references = </top/quad>) {}'
    below = 'def Xform "far" { double3 xformOp:translate = (5, 0, 0)\n'
    below += 'uniform token[] xformOpOrder = ["xformOp:translate"]\n' + again + "\n}"
    asset = read_asset("a.usda", usda(QUAD, below))
    assert len(asset.faces) == 4
    assert np.ptp(asset.vertices[:, 0]) == 6


@pytest.mark.parametrize("pack", [False, True])
def test_looks_in_another_file_are_no_part_of_a_surface(pack: bool) -> None:
    data = usda(QUAD, 'def "looks" (references = @looks.mtlx@</MaterialX>) {}')
    files = {"scene.usda": data, "looks.mtlx": b"<materialx/>"}
    asset = read_asset("a", usdz(files) if pack else data)
    assert len(asset.faces) == 2


def test_a_unit_may_be_stored_as_a_float(tmp_path: Path) -> None:
    sdf = pytest.importorskip("pxr.Sdf")
    made = tmp_path / "float.usdc"
    layer = sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(usda(QUAD, metadata="metersPerUnit = 0.5").decode())
    layer.Export(str(made))
    of_double, of_float = bytes([0x3F, 0, 0, 9, 0x40]), bytes([0x3F, 0, 0, 8, 0x40])
    data = made.read_bytes()
    assert data.count(of_double) == 1

    asset = read_asset("a", data.replace(of_double, of_float))

    assert np.allclose(asset.vertices, (FLAT + ALONG) / 2)


@pytest.mark.parametrize("data", [step_ball(), three_mf([TETRAHEDRON], [(1, None)]), usda(QUAD)])
def test_what_was_converted_is_measured_and_not_refined(data: bytes) -> None:
    with pytest.raises(InputError, match="it can be a reference, and be measured, but not refined"):
        read_asset("part", data).ensure_writable()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"ISO-10303-21;\nHEADER;", "a STEP file that cannot be read: it is damaged"),
        (step_ball()[:-200], "a STEP file that cannot be read"),
        (step_ball().replace(b"SPHERICAL", b"SPHERICLA"), "it holds no shape with a surface"),
        (three_mf([], []), "a 3MF file that cannot be read: it holds no mesh with faces"),
        (
            packed({"[Content_Types].xml": b"<", "3D/3dmodel.model": b"<"}),
            "a 3MF file that cannot be read: it is damaged",
        ),
        (b"#usda 1.0\ndef Mesh {", "a USD file that cannot be read: it is damaged"),
        (usda(), "a USD file that cannot be read: it holds no mesh with faces"),
        (
            usda(QUAD.replace("[0, 1, 2, 3]", "[0, 1, 2, 9]")),
            "a face of 'quad' has a corner that is none of its points",
        ),
        (usda(QUAD.replace("[4]", "[5]")), "do not have the corners that it lists"),
        (usda('def Sphere "ball" {}'), "'ball' is a Sphere, and only meshes are read"),
        (usda('def "a" (references = @/etc/other.usda@) {}'), "several files, of which '/etc/"),
        (
            usdz({"a.usda": usda('def "a" (references = @../b.usda@) {}')}),
            r"a USDZ file that cannot be read: it lacks its file '\.\./b\.usda'",
        ),
    ],
)
def test_a_damaged_file_is_refused_in_words(data: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_asset("part", data)
    assert caught.value.file == "part"


def test_a_reader_that_does_not_end_is_ended() -> None:
    policy = ReadPolicy(chord=1e-6)

    with pytest.raises(
        LimitError, match=r"more than the 1 seconds.*MESHCONE_LIMIT_CONVERT_SECONDS"
    ):
        read_asset("ball.step", step_ball(), limits=Limits(convert_seconds=1), policy=policy)


@pytest.mark.parametrize(
    ("data", "extra"),
    [
        (step_ball(), "cad"),
        (three_mf([TETRAHEDRON], [(1, None)]), "3mf"),
        (usda(QUAD), "usd"),
        (usdz({"scene.usda": usda(QUAD)}), "usd"),
    ],
)
def test_without_its_extra_a_format_is_refused_by_the_name_of_that(
    data: bytes, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = importlib.util.find_spec

    def without(name: str, *rest: Any) -> Any:
        return None if name in ("cascadio", "lib3mf", "pxr") else found(name, *rest)

    monkeypatch.setattr(importlib.util, "find_spec", without)

    with pytest.raises(InputError, match=rf"pip install 'meshcone\[{extra}\]'"):
        read_asset("part", data)


def test_what_a_file_makes_counts_against_the_limits() -> None:
    with pytest.raises(LimitError, match="MESHCONE_LIMIT_VERTICES"):
        read_asset("ball.step", step_ball(), limits=Limits(vertices=100))


@pytest.mark.parametrize(
    ("kind", "data"),
    [
        ("step", step_ball()),
        ("3mf", three_mf([TETRAHEDRON], [(1, None)])),
        ("usd", usda(QUAD)),
        ("usdz", usdz({"quad.usda": usda(QUAD)})),
    ],
)
def test_an_archive_may_have_one_in_it(kind: str, data: bytes) -> None:
    asset = read_asset("part.zip", packed({f"part/ball.{kind}": data, "about.txt": b""}))

    assert (asset.format, asset.name) == (kind, "part.zip")


def test_an_archive_of_a_mesh_is_no_3mf() -> None:
    files = {"a.obj": shapes.obj(*shapes.sphere(1)), "notes.model": b""}

    assert read_asset("a.zip", packed(files)).format == "obj"
