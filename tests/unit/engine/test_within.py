"""A tolerance to reach, and the proof that it is reached."""

from __future__ import annotations

import pytest
import trimesh

from meshcone.errors import InputError, SolveTimeoutError
from meshcone.files import MeshFile
from meshcone.options import Options, Tolerance, parse_options
from meshcone.progress import Progress
from meshcone.report.within import PlaceBeyond, WithinRecord
from meshcone.verbs.refine import Refinement
from meshcone.verbs.verify import verify
from meshcone.verbs.within import refine_within
from tests import shapes

FACES = shapes.sphere(3)[1]
REFERENCE = MeshFile("ball.obj", shapes.obj(*shapes.sphere(3)))
SOURCE = MeshFile("rough.obj", shapes.obj(shapes.noisy(shapes.sphere(3)[0]), FACES))


def options(**asked: object) -> Options:
    quick = {"samples": 500, "emd_samples": 16, "curvature_samples": 16}
    return parse_options({"effort": "fast", "quality": quick, **asked})


def refined(text: str, **asked: object) -> Refinement:
    return refine_within(SOURCE, REFERENCE, options(within=text, **asked))


def told(found: Refinement) -> WithinRecord:
    assert found.report.within is not None
    return found.report.within


def test_what_the_first_refinement_reaches_takes_one() -> None:
    found = refined("0.2mm")
    assert (told(found).reached, told(found).attempts, told(found).places) == (True, 1, ())
    assert (told(found).limit_model, told(found).unit) == (0.2, "mm")
    deviation = found.report.deviation
    assert deviation is not None
    assert deviation.max.upper_model <= 0.2


def test_what_it_does_not_reach_is_tried_harder() -> None:
    first = refined("0.2").report.quality.refined
    assert first is not None
    wanted = 0.9 * first.point_to_surface.max * 2.0  # the radius
    found = refined(f"{wanted:.6f}")
    assert told(found).attempts > 1
    assert len(found.report.options.surface.fairness) > 5


def test_what_nothing_reaches_returns_the_closest_and_the_places() -> None:
    found = refined("1e-9%")
    assert (told(found).reached, told(found).attempts) == (False, 3)
    assert told(found).limit_model == pytest.approx(2e-11)
    assert told(found).places[0].distance_model == pytest.approx(farthest(found))
    assert found.report.gates is not None
    assert found.report.gates.verdict == "fail"


def farthest(found: Refinement) -> float:
    assert found.report.quality.refined is not None
    return found.report.quality.refined.point_to_surface.max * found.report.frame.radius


def test_the_answer_states_the_options_it_was_made_with() -> None:
    stated = refined("0.2mm").report.options
    assert (stated.within, stated.gates["deviation.max"].max_model) == (None, 0.2)


def failures(found: Refinement, **edited: object) -> dict[str, str]:
    """What a verification finds wrong where the section ``within`` is edited."""
    assert found.certificate is not None
    stored = MeshFile("certificate.npz", found.certificate)
    report = found.report.model_copy(update={"within": told(found).model_copy(update=edited)})
    checks = verify(report, stored, SOURCE, REFERENCE, MeshFile(found.name, found.data)).checks
    return {check.name: check.words for check in checks if not check.ok}


def test_what_a_report_says_of_its_tolerance_is_held_against_its_intervals() -> None:
    found = refined("0.2mm")
    place = PlaceBeyond(on="mesh", position=(0.0, 0.0, 2.0), distance_model=0.3)

    assert failures(found) == {}
    assert failures(found, reached=False).keys() == {"within"}
    assert failures(found, places=(place,)).keys() == {"within"}
    assert failures(found, limit_model=0.3).keys() == {"within"}
    assert failures(found, unit="m").keys() == {"within"}
    assert failures(found, asked="0.1mm").keys() == {"within"}
    assert failures(found, asked="no tolerance").keys() == {"within"}


def test_a_tolerance_that_is_not_reached_is_said_to_be_by_the_intervals_alone() -> None:
    found = refined("1e-9%")

    assert failures(found) == {}
    assert failures(found, reached=True, places=()) == {
        "within": "the intervals say otherwise whether the tolerance is reached"
    }
    assert failures(found, places=()).keys() == {"within"}


def test_without_a_tolerance_there_is_one_refinement_and_no_word_of_one() -> None:
    assert refine_within(SOURCE, REFERENCE, options()).report.within is None


def test_attempts_are_parts_of_one_progress() -> None:
    seen: list[Progress] = []
    refine_within(SOURCE, REFERENCE, options(within="1e-9%"), seen.append)
    fractions = [each.fraction for each in seen]
    assert fractions == sorted(fractions)
    assert 2 / 3 < fractions[-1] < 1


def test_what_was_found_stands_where_there_is_no_time_to_try_harder() -> None:
    written: list[Progress] = []

    def out_of_time_at_the_second(progress: Progress) -> None:
        if written:
            raise SolveTimeoutError("the time is over")
        if progress.stage == "quality":
            written.append(progress)

    asked = options(within="1e-9%")
    found = refine_within(SOURCE, REFERENCE, asked, out_of_time_at_the_second)

    assert (told(found).reached, told(found).attempts) == (False, 2)
    assert found.report.outcome == "improved"


def test_no_attempt_is_begun_that_the_time_left_is_not_enough_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ticks = iter([0.0, 40.0])  # the first attempt takes 40 seconds of 100
    monkeypatch.setattr("meshcone.verbs.within.monotonic", lambda: next(ticks))

    found = refine_within(SOURCE, REFERENCE, options(within="1e-9%"), solve_seconds=100.0)

    assert (told(found).reached, told(found).attempts) == (False, 1)


def test_a_share_of_the_radius_is_a_relative_bound() -> None:
    gates = options(within="0.5 %").gated_within("a.obj", "b.obj").gates
    assert gates["deviation.max"].max == pytest.approx(0.005)
    assert gates["deviation.max"].max_model is None


def test_a_length_keeps_the_name_of_its_unit() -> None:
    gated = options(within="1.5e-1mm").gated_within("a.obj", "b.obj")
    gate = gated.gates["deviation.max"]
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
    with pytest.raises(InputError, match="a glTF is in metres, and 'furlongs' is not a known unit"):
        Tolerance.parse("3 furlongs").in_metres()


@pytest.mark.parametrize("reference", ["ball.glb", "ball.obj"])
def test_what_is_proven_of_a_gltf_is_told_in_metres(reference: str) -> None:
    ball = trimesh.Trimesh(*shapes.sphere(2))
    rough = trimesh.Trimesh(shapes.noisy(shapes.sphere(2)[0]), ball.faces)
    files = {name: MeshFile(name, _exported(ball, name)) for name in ("ball.glb", "ball.obj")}
    source = MeshFile("rough.glb", _exported(rough, "rough.glb"))
    found = refine_within(source, files[reference], options(within="2000mm"))
    assert (told(found).reached, told(found).limit_model) == (True, 2)
    assert found.report.statement is not None
    assert " m of the reference" in found.report.statement


def _exported(mesh: trimesh.Trimesh, name: str) -> bytes:
    data = mesh.export(file_type=name.rpartition(".")[2])
    return data if isinstance(data, bytes) else str(data).encode()


@pytest.mark.parametrize("text", ["", "mm", "-1", "0", "1 2", "nan", "0.5mm²", "1e99"])
def test_what_is_no_tolerance_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="is not a tolerance"):
        Tolerance.parse(text)


def test_a_tolerance_and_a_gate_on_the_same_are_refused() -> None:
    with pytest.raises(InputError, match="there is one already"):
        refined("1", gates={"deviation.max": {"max": 0.1}})


def test_a_tolerance_without_proof_is_refused() -> None:
    with pytest.raises(InputError, match=r"deviation\.prove"):
        refined("1", deviation={"prove": False})


@pytest.mark.parametrize("mode", ["measure", "audit"])
def test_a_tolerance_where_nothing_is_refined_is_refused(mode: str) -> None:
    with pytest.raises(InputError, match=f"option 'within': .*the mode is '{mode}'"):
        options(within="1mm", mode=mode)


def test_a_number_is_a_tolerance_in_the_unit_of_the_files() -> None:
    gates = options(within=0.5).gated_within("a.obj", "b.obj").gates
    assert gates["deviation.max"].max_model == 0.5


def test_what_does_not_fit_is_tried_once() -> None:
    vertices, faces = shapes.sphere(2)
    away = MeshFile("away.obj", shapes.obj([[x + 9.0, y, z] for x, y, z in vertices], faces))

    found = refine_within(away, REFERENCE, options(within="1%"))

    assert (found.report.outcome, told(found).attempts) == ("misaligned", 1)
