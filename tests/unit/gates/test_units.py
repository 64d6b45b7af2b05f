"""Lengths of gates in millimetres, held against files in metres."""

from __future__ import annotations

import pytest

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.gates.fitting import require_known, require_units
from meshcone.gates.records import GateCheck
from meshcone.gates.rules import GateRule
from meshcone.gates.units import Unit, format_named, unit_for
from meshcone.options import Options, parse_options
from meshcone.report.report import MeasureReport
from meshcone.verbs.audit import audit
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import refine
from meshcone.verbs.verify import verify
from tests import shapes

HEIGHT = 0.2  # of a spike on a ball of radius 2, in the unit of the files
QUICK = {"samples": 500, "emd_samples": 16, "curvature_samples": 16}


def options(gates: dict[str, object], **others: object) -> Options:
    return parse_options({"mode": "measure", "gates": gates, "quality": QUICK, **others})


def ball(kind: str, height: float = 0.0) -> MeshFile:
    vertices, faces = shapes.sphere(2)
    vertices[20] *= 1 + height / 2.0
    write = shapes.glb if kind == "glb" else shapes.obj
    return MeshFile(f"ball.{kind}", write(vertices, faces))


def measured(kind: str, gates: dict[str, object], reference: str | None = None) -> MeasureReport:
    return measure(ball(kind, HEIGHT), ball(reference or kind), options(gates))


def only(report: MeasureReport) -> GateCheck:
    assert report.gates is not None
    [check] = report.gates.checks
    return check


@pytest.mark.parametrize(
    ("unit", "allowed", "status"),
    [("mm", 201, "pass"), ("mm", 199, "fail"), ("cm", 19.9, "fail"), ("m", 0.201, "pass")],
)
@pytest.mark.parametrize("key", ["point_to_surface.max", "deviation.max"])
def test_a_bound_on_a_gltf_is_in_the_unit_it_names(
    key: str, unit: str, allowed: float, status: str
) -> None:
    found = only(measured("glb", {key: {"max_model": allowed, "unit": unit}}))

    assert (found.status, found.limit) == (status, allowed)
    assert f" {unit}" in found.words


def test_a_proof_goes_on_until_it_has_decided_in_that_unit() -> None:
    report = measured("glb", {"deviation.max": {"max_model": 300, "unit": "mm"}})

    assert report.deviation is not None
    assert report.deviation.max.proven
    assert report.deviation.max.upper_model <= 0.3


def test_the_statement_is_in_the_unit_that_a_gate_names() -> None:
    report = measured("glb", {"deviation.max": {"max_model": 199, "unit": "mm"}})

    assert report.statement is not None
    assert " mm of the reference" in report.statement
    assert float(report.statement.split("within ")[1].split()[0]) == pytest.approx(200, rel=0.05)


def test_a_relative_bound_is_told_in_that_unit_too() -> None:
    found = only(measured("glb", {"point_to_surface.max": {"max": 0.05, "unit": "mm"}}))

    assert found.words.endswith("allowed 0.05 of the radius (100 mm)")


def test_the_unit_of_another_format_is_a_name() -> None:
    found = only(measured("obj", {"deviation.max": {"max_model": 0.3, "unit": "mm"}}))

    assert found.status == "pass"
    assert " mm" in found.words


@pytest.mark.parametrize("unit", ["cubits", "millimeters", "MM"])
@pytest.mark.parametrize("pair", [("glb", "glb"), ("obj", "glb"), ("glb", "obj")])
def test_a_name_that_is_no_length_is_refused_where_files_are_in_metres(
    pair: tuple[str, str], unit: str
) -> None:
    said = f"gate 'deviation.max': a glTF is in metres, and '{unit}' is not a known unit"
    with pytest.raises(InputError, match=said):
        measured(pair[0], {"deviation.max": {"max_model": 0.3, "unit": unit}}, pair[1])


def test_the_unit_of_a_gltf_alone_is_checked_too() -> None:
    gates = {"asset.size.height": {"max_model": 0.8, "unit": "meter"}}

    with pytest.raises(InputError, match=r"asset\.size\.height.: a glTF is in metres"):
        audit(ball("glb"), None, options(gates, mode="audit"))


def test_a_file_that_takes_the_size_of_a_gltf_has_no_unit_of_its_own() -> None:
    gates = {"deviation.max": GateRule(max_model=0.3, unit="units")}

    require_units(gates, "glb", "obj", scaled=True)
    with pytest.raises(InputError, match="'units' is not a known unit"):
        require_units(gates, "glb", "obj", scaled=False)


@pytest.mark.parametrize(("unit", "millimetres"), [("mm", 1.0), ("cm", 10.0), ("in", 25.4)])
def test_a_step_is_in_millimetres(unit: str, millimetres: float) -> None:
    assert unit_for(unit, "step", "obj") == Unit(unit, pytest.approx(millimetres))
    assert unit_for(None, "step", "obj") == Unit("mm")


def test_a_name_that_is_no_length_is_refused_for_a_step() -> None:
    with pytest.raises(InputError, match="a STEP is read in millimetres, and 'inch' is not"):
        unit_for("inch", "obj", "step")


def test_lengths_of_a_usd_are_not_converted() -> None:
    assert unit_for("m", "obj", "usd") == Unit("m")
    assert unit_for(None, "usdz") == Unit("units")
    with pytest.raises(InputError, match="nothing in 'mm' is converted"):
        unit_for("mm", "usdz")


@pytest.mark.parametrize(
    ("name", "known"),
    [("a.GLB", "glb"), ("b.stp", "step"), ("c.usda", "usd"), ("d.zip", "zip"), ("e", "")],
)
def test_a_format_is_told_by_the_name(name: str, known: str) -> None:
    assert format_named(name) == known


@pytest.mark.parametrize("bound", ["max", "min"])
def test_a_bound_on_a_size_in_another_unit_than_the_gate_is_in_is_refused(bound: str) -> None:
    gates = options({"asset.size.height": {bound: 800, "unit": "mm"}}).gates

    with pytest.raises(InputError, match=f"and the unit here is 'mm'; write {bound}_model"):
        require_known(gates, "measure")


def test_a_pair_with_a_gltf_in_it_is_in_metres() -> None:
    gate = {"deviation.max": {"max_model": 300, "unit": "mm"}}

    assert only(measured("glb", gate, "obj")).status == "pass"
    assert only(measured("obj", gate, "glb")).status == "pass"


def test_the_size_of_a_gltf_is_told_in_millimetres() -> None:
    size = {"asset.size.height": {"min_model": 3990, "max_model": 4010, "unit": "mm"}}

    report = measured("glb", size)

    assert report.gates is not None
    assert report.gates.verdict == "pass"
    assert report.gates.checks[0].value == pytest.approx(4000, rel=1e-3)


def test_area_beyond_takes_its_tolerance_in_that_unit() -> None:
    gate = {"tolerance_model": 100, "max": 0.5, "unit": "mm"}

    report = measured("glb", {"deviation.area_beyond": gate})

    assert report.deviation is not None
    assert report.deviation.area_beyond is not None
    assert report.deviation.area_beyond.tolerance_model == pytest.approx(0.1)


def test_what_is_told_in_millimetres_is_verified() -> None:
    gates = {
        "deviation.max": {"max_model": 150, "unit": "mm"},
        "deviation.area_beyond": {"tolerance_model": 100, "max": 0.5, "unit": "mm"},
    }
    source, reference = ball("glb", HEIGHT), ball("glb")

    done = refine(source, reference, options(gates, mode="refine", effort="fast"))

    assert done.certificate is not None
    stored = MeshFile("certificate.npz", done.certificate)
    again = verify(done.report, stored, source, reference, MeshFile(done.name, done.data))
    assert again.ok, str(again)


@pytest.mark.parametrize("unit", ["mm", "in"])
def test_what_lies_on_its_reference_passes_a_bound_of_0_in_any_unit(unit: str) -> None:
    gates = {"deviation.max": {"max_model": 0, "unit": unit}}

    report = measure(ball("glb"), ball("glb"), options(gates))

    assert only(report).status == "pass"
    assert report.statement is not None
    assert f"every point within 0 {unit} of the reference" in report.statement


def test_what_is_no_0_is_rounded_outwards_into_another_unit() -> None:
    inch = Unit("in", 0.0254)

    assert inch.at_least(0.1) < 0.1 / 0.0254 < inch.at_most(0.1)
