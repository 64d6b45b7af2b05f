"""What the functions return."""

from __future__ import annotations

import copy
import json
import pickle
import re
from html import unescape
from pathlib import Path
from typing import Any

import pytest
import trimesh

import meshcone
from meshcone.errors import ArgumentError, InputError, MeshConeError
from tests import shapes
from tests.unit.library.meshes import FACES, ROUGH, VERTICES, refined, rough, smooth


@pytest.fixture(scope="module")
def result() -> meshcone.Refined:
    return refined()


def test_every_form_of_a_mesh_leads_to_the_same_file(result: meshcone.Refined) -> None:
    again = meshcone.refine(rough(), smooth(), effort="fast")
    from_file = meshcone.refine(
        meshcone.load((ROUGH, FACES)), (result.reference.name, result.reference.data), effort="fast"
    )

    assert again.data == from_file.data == result.data


def test_the_mesh_is_that_of_the_file_with_the_order_of_the_arrays(
    result: meshcone.Refined,
) -> None:
    read = trimesh.load_mesh(
        trimesh.util.wrap_as_stream(result.data), file_type="obj", process=False
    )

    assert result.mesh.faces.tobytes() == FACES.tobytes()
    assert result.mesh.vertices == pytest.approx(read.vertices, abs=0)
    assert abs(result.mesh.vertices - ROUGH).max() > 0.01


def test_the_mesh_has_the_faces_that_detail_has_added() -> None:
    finer = meshcone.refine(rough(), shapes.sphere(3), effort="fast", detail={"growth": 2})

    assert finer.report.detail is not None
    for mesh in (finer.mesh, finer.scene.to_mesh(), meshcone.load(finer).mesh):
        assert len(mesh.faces) == finer.report.detail.faces_after > len(FACES)
        assert mesh.is_watertight


def test_report_and_certificate_are_the_engines(result: meshcone.Refined) -> None:
    assert result.report.outcome == "improved"
    assert result.report.output.name == result.name == "source.refined.obj"
    assert result.certificate is not None


def test_a_result_can_be_given_where_a_mesh_can(result: meshcone.Refined) -> None:
    measured = meshcone.measure(result, smooth())

    assert measured.report.quality.input.chamfer == result.report.quality.refined.chamfer


def test_reprs_are_short(result: meshcone.Refined) -> None:
    verdict = meshcone.gate(result, smooth(), gates={"chamfer": {"max": 1}})

    assert re.fullmatch(
        r"<Refined source\.obj → reference\.obj: improved, "
        r"mean deviation [\d.]+ → [\d.]+ of the radius>",
        repr(result),
    )
    assert repr(verdict) == "<Verdict ok: source.refined.obj: 1 of 1 checks passed>"
    others = (result.done, result.file, result.report, verdict.result, verdict.report)
    assert all(len(repr(each)) < 300 for each in others)
    assert str(result.report).startswith("<Report source.obj → reference.obj: improved; has schema")


def test_a_result_goes_from_one_process_to_another(result: meshcone.Refined) -> None:
    assert len(result.mesh.vertices)  # which it keeps for the next time

    copy = pickle.loads(pickle.dumps(result))  # noqa: S301 - our own

    assert (copy.data, copy.certificate) == (result.data, result.certificate)
    assert copy.report == result.report
    assert meshcone.verify(copy)


def test_it_is_shown_in_a_notebook_as_the_offline_report_in_a_frame(
    result: meshcone.Refined,
) -> None:
    found = re.fullmatch(
        r'<iframe srcdoc="([^"]*)" sandbox="allow-scripts" title="[^"]*" style="[^"]*"></iframe>',
        result._repr_html_(),
    )

    assert found
    page = unescape(found[1])
    assert page.startswith("<!DOCTYPE html>")
    [assets] = json.loads(re.search(r'id="assets">(.*?)</script>', page)[1])  # type: ignore[index]
    assert assets["report"] == json.loads(result.report.model_dump_json())


def test_a_measurement_and_a_verdict_are_shown_too(result: meshcone.Refined) -> None:
    measured = meshcone.measure(result, smooth())
    verdict = meshcone.gate(result, smooth(), gates={"chamfer": {"max": 1}})

    assert "<!DOCTYPE html>" in measured.html()
    assert measured._repr_html_().startswith("<iframe srcdoc=")
    assert verdict._repr_html_().startswith("<iframe srcdoc=")


def test_save_writes_mesh_report_certificate_and_page(
    result: meshcone.Refined, tmp_path: Path
) -> None:
    result.save(tmp_path / "out.obj", report=tmp_path / "out.json", html=tmp_path / "out.html")

    assert (tmp_path / "out.obj").read_bytes() == result.data
    assert (tmp_path / "out.certificate.npz").read_bytes() == result.certificate
    assert json.loads((tmp_path / "out.json").read_bytes())["outcome"] == "improved"
    assert (tmp_path / "out.html").read_bytes().startswith(b"<!DOCTYPE html>")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A pair whose buffers are apart, and a link to the reference."""
    for name, vertices in (("rough", ROUGH), ("ball", VERTICES)):
        document, buffer = shapes.gltf(vertices, FACES, f"{name}.bin")
        (tmp_path / f"{name}.gltf").write_bytes(document)
        (tmp_path / f"{name}.bin").write_bytes(buffer)
    (tmp_path / "link.gltf").symlink_to("ball.gltf")
    return tmp_path


def test_save_never_writes_over_an_input(folder: Path) -> None:
    made = meshcone.refine(folder / "rough.gltf", folder / "ball.gltf", effort="fast")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}

    for name in ("rough.gltf", "ball.gltf", "link.gltf", "rough.bin", "ball.bin"):
        with pytest.raises(InputError, match="it is an input and would be overwritten"):
            made.save(folder / name)
    with pytest.raises(InputError, match="it is an input and would be overwritten"):
        made.save(folder / "out.gltf", report=folder / "ball.bin")

    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("out.glb", "its name must end in '.obj'"),
        ("absent/out.obj", "its directory does not exist"),
        (".", "is a directory"),
    ],
)
def test_save_refuses_a_place_that_cannot_be(
    result: meshcone.Refined, tmp_path: Path, name: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        result.save(tmp_path / name)


def test_a_verdict_has_a_row_for_each_bound_and_is_true_if_all_hold() -> None:
    gates = {"point_to_surface.max": {"max": 1e-3}, "validity.watertight": {"equals": True}}

    bad = meshcone.gate(rough(), smooth(), gates=gates)
    good = meshcone.gate(smooth(), smooth(), gates=gates)

    assert (bad.passed, bad.verdict, bool(bad)) == (False, "fail", False)
    assert [check.status for check in bad.checks] == ["fail", "pass"]
    assert str(bad).splitlines()[1] == "ok          watertight: yes"
    assert "FAILED: source.obj: 1 of 2 checks passed; worst deviation" in repr(bad)
    assert good.passed
    assert good


def test_a_verdict_may_be_of_what_refining_leads_to() -> None:
    gates = {"point_to_surface.mean": {"max_ratio_to_input": 0.5}}

    verdict = meshcone.gate(rough(), smooth(), gates=gates, refine=True, effort="fast")

    assert verdict.passed
    assert isinstance(verdict.result, meshcone.Refined)


def test_gates_come_from_a_file_with_classes(tmp_path: Path) -> None:
    file = tmp_path / "gates.toml"
    file.write_text('[classes.props]\nmatch = ["props/*"]\ngates = {chamfer = {max = 1}}\n')

    held = meshcone.gate(rough(), smooth(), gates=file, name="props/ball.obj")
    other = meshcone.gate(rough(), smooth(), gates=file)

    assert held.passed
    assert repr(other) == "<Verdict not tested: source.obj: no gate applies>"
    assert not other


@pytest.mark.parametrize(
    ("gates", "kind", "said"),
    [
        ({}, InputError, "there is no gate in it"),
        ({"chamfr": {"max": 1}}, InputError, "unknown gate 'chamfr'; did you mean 'chamfer'?"),
        ({"chamfer": 1}, InputError, "must be a table of bounds, such as { max = 0.01 }"),
        (3, ArgumentError, "'gates' must be a path or a mapping, found a value of type int"),
        ("absent.toml", InputError, "absent.toml: cannot be read"),
    ],
)
def test_wrong_gates_are_said(gates: object, kind: type[MeshConeError], said: str) -> None:
    with pytest.raises(kind) as error:
        meshcone.gate(rough(), smooth(), gates=gates)  # type: ignore[arg-type]

    assert said in str(error.value)


def test_a_result_is_verified_as_it_is(result: meshcone.Refined) -> None:
    verification = meshcone.verify(result)

    assert verification.ok
    assert verification
    assert repr(verification) == f"<Verification ok: {len(verification.checks)} checks>"


def test_another_mesh_is_not_verified(result: meshcone.Refined) -> None:
    verification = meshcone.verify(result, refined=(result.name, result.source.data))

    assert not verification
    assert repr(verification).endswith("written, report, displacement, metrics, road>")
    assert "FAILED written" in str(verification)


def test_a_report_is_verified_with_its_files(result: meshcone.Refined, tmp_path: Path) -> None:
    result.save(tmp_path / "out.obj", report=tmp_path / "out.json")

    assert meshcone.verify(
        tmp_path / "out.json", source=rough(), reference=smooth(), refined=tmp_path / "out.obj"
    )
    with pytest.raises(ArgumentError, match="'source' is missing"):
        meshcone.verify(tmp_path / "out.json")


def test_a_result_that_kept_its_input_is_verified_to_be_the_input() -> None:
    verification = meshcone.verify(refined(surface={"fairness": []}))

    assert verification
    assert "the refined file is the source, byte for byte" in str(verification)


def test_a_result_that_kept_its_input_and_proves_nothing_has_nothing_to_verify() -> None:
    kept = refined(surface={"fairness": []}, deviation={"prove": False})

    assert kept.certificate is None
    with pytest.raises(InputError, match="the result has no certificate"):
        meshcone.verify(kept)


def test_an_audit_takes_any_mesh_with_or_without_a_reference() -> None:
    alone = meshcone.audit(rough(), gates={"asset.budget.triangles": {"max": len(FACES)}})
    beside = meshcone.audit((VERTICES, FACES), rough())

    assert alone.report.gates is not None
    assert alone.report.gates.verdict == "pass"
    assert alone.report.changes is None
    assert beside.report.changes is not None
    assert repr(alone) == f"<Audited asset.obj: {len(FACES):,} triangles, 0 materials>"


def test_a_verdict_can_be_about_what_is_kept_alone() -> None:
    assert meshcone.gate(smooth(), smooth(), keep=["materials"]).passed
    with pytest.raises(ArgumentError, match="'gates', 'profile' and 'keep' are all missing"):
        meshcone.gate(smooth(), smooth())


@pytest.mark.parametrize("names", ["all", "materials,uvs", ("materials", "uvs")])
def test_what_is_kept_can_be_one_text(names: Any) -> None:
    verdict = meshcone.gate(smooth(), smooth(), keep=names)

    assert verdict.passed
    assert "changes.lost.materials" in [check.key for check in verdict.checks]


def test_what_is_kept_is_something_that_can_be() -> None:
    wrong: Any = "material"
    with pytest.raises(InputError, match="option 'keep"):
        meshcone.gate(smooth(), smooth(), keep=wrong)


def test_a_verdict_can_be_about_a_profile_and_gates_that_replace_some_of_it() -> None:
    key = "asset.budget.triangles"
    plain = meshcone.gate(smooth(), smooth(), profile="web")
    strict = meshcone.gate(smooth(), smooth(), profile="web", gates={key: {"max": 3}})

    assert [check.allowed for check in plain.checks if check.key == key] == [100_000]
    assert [(check.allowed, check.status) for check in strict.checks if check.key == key] == [
        (3, "fail")
    ]
    assert len(strict.checks) == len(plain.checks)


def test_a_profile_that_does_not_exist_is_refused() -> None:
    with pytest.raises(InputError, match="unknown profile 'wep'; did you mean 'web'"):
        meshcone.gate(smooth(), smooth(), profile="wep")


def test_results_are_equal_to_themselves_alone(result: meshcone.Refined) -> None:
    verdict = meshcone.gate(smooth(), smooth(), keep="all")

    for each in (result, verdict, verdict.result, meshcone.audit(smooth())):
        assert {each} == {each} != {copy.deepcopy(each)}
