"""A tolerance to reach, and the proof that it is reached."""

from __future__ import annotations

import pytest
import trimesh

from meshcone.errors import InputError, SolveTimeoutError
from meshcone.files import MeshFile
from meshcone.options import Options, parse_options
from meshcone.progress import Progress
from meshcone.verbs.within import Promise, Tolerance, refine_within
from tests import shapes

FACES = shapes.sphere(3)[1]
REFERENCE = MeshFile("ball.obj", shapes.obj(*shapes.sphere(3)))
SOURCE = MeshFile("rough.obj", shapes.obj(shapes.noisy(shapes.sphere(3)[0]), FACES))


def options(**asked: object) -> Options:
    quick = {"samples": 500, "emd_samples": 16, "curvature_samples": 16}
    return parse_options({"effort": "fast", "quality": quick, **asked})


def promise(text: str, **asked: object) -> Promise:
    return refine_within(SOURCE, REFERENCE, options(**asked), Tolerance.parse(text))


def test_what_the_first_refinement_reaches_takes_one() -> None:
    found = promise("0.2mm")
    assert (found.kept, found.attempts) == (True, 1)
    deviation = found.refinement.report.deviation
    assert deviation is not None
    assert deviation.max.upper_model <= 0.2


def test_what_it_does_not_reach_is_tried_harder() -> None:
    first = promise("0.2").refinement.report.quality.refined
    assert first is not None
    wanted = 0.9 * first.point_to_surface.max * 2.0  # the radius
    found = promise(f"{wanted:.6f}")
    assert found.attempts > 1
    assert len(found.refinement.report.options.surface.fairness) > 5


def test_what_nothing_reaches_returns_the_closest() -> None:
    found = promise("1e-9%")
    assert (found.kept, found.attempts) == (False, 3)
    assert found.refinement.report.gates is not None
    assert found.refinement.report.gates.verdict == "fail"


def test_what_was_found_stands_where_there_is_no_time_to_try_harder() -> None:
    written: list[Progress] = []

    def out_of_time_at_the_second(progress: Progress) -> None:
        if written:
            raise SolveTimeoutError("the time is over")
        if progress.stage == "quality":
            written.append(progress)

    found = refine_within(
        SOURCE, REFERENCE, options(), Tolerance.parse("1e-9%"), out_of_time_at_the_second
    )

    assert (found.kept, found.attempts) == (False, 2)
    assert found.refinement.report.outcome == "improved"


def test_a_share_of_the_radius_is_a_relative_bound() -> None:
    gates = Tolerance.parse("0.5 %").gated(options()).gates
    assert gates["deviation.max"].max == pytest.approx(0.005)
    assert gates["deviation.max"].max_model is None


def test_a_length_keeps_the_name_of_its_unit() -> None:
    gate = Tolerance.parse("1.5e-1mm").gated(options()).gates["deviation.max"]
    assert (gate.max_model, gate.unit) == (0.15, "mm")


@pytest.mark.parametrize(
    ("text", "metres"), [("5mm", 0.005), ("2 cm", 0.02), ("0.005m", 0.005), ("1in", 0.0254)]
)
def test_a_length_is_converted_where_files_are_in_metres(text: str, metres: float) -> None:
    converted = Tolerance.parse(text).in_metres()
    assert (converted.value, converted.unit) == (pytest.approx(metres), "m")


@pytest.mark.parametrize("text", ["0.5", "0.2%"])
def test_a_tolerance_without_a_unit_needs_no_conversion(text: str) -> None:
    assert Tolerance.parse(text).in_metres() == Tolerance.parse(text)


def test_a_unit_that_is_not_known_is_refused_where_files_are_in_metres() -> None:
    with pytest.raises(InputError, match="a glTF is in metres, and 'furlongs' is no unit"):
        Tolerance.parse("3 furlongs").in_metres()


@pytest.mark.parametrize("reference", ["ball.glb", "ball.obj"])
def test_what_is_proven_of_a_gltf_is_told_in_metres(reference: str) -> None:
    ball = trimesh.Trimesh(*shapes.sphere(2))
    rough = trimesh.Trimesh(shapes.noisy(shapes.sphere(2)[0]), ball.faces)
    files = {name: MeshFile(name, _exported(ball, name)) for name in ("ball.glb", "ball.obj")}
    source = MeshFile("rough.glb", _exported(rough, "rough.glb"))
    found = refine_within(source, files[reference], options(), Tolerance.parse("2000mm"))
    assert found.kept
    assert found.refinement.report.statement is not None
    assert " m of the reference" in found.refinement.report.statement
    assert found.refinement.report.options.gates["deviation.max"].max_model == 2


def _exported(mesh: trimesh.Trimesh, name: str) -> bytes:
    data = mesh.export(file_type=name.rpartition(".")[2])
    return data if isinstance(data, bytes) else str(data).encode()


@pytest.mark.parametrize("text", ["", "mm", "-1", "0", "1 2", "nan", "0.5mm²", "1e99"])
def test_what_is_no_tolerance_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="is no tolerance"):
        Tolerance.parse(text)


def test_a_tolerance_and_a_gate_on_the_same_are_refused() -> None:
    with pytest.raises(InputError, match="there is one already"):
        promise("1", gates={"deviation.max": {"max": 0.1}})


def test_a_tolerance_without_proof_is_refused() -> None:
    with pytest.raises(InputError, match=r"deviation\.prove"):
        promise("1", deviation={"prove": False})
