"""Files in, a refined file, its report and its certificate out."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.certificate.file import read_certificate
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.progress import Progress
from meshcone.report.report import Report, diagnostics_csv
from meshcone.verbs.refine import Refinement, refine
from tests.unit.engine.pairs import CAPPED, rough, smooth


@pytest.fixture(scope="module")
def refinement() -> Refinement:
    return refine(rough(), smooth(), parse_options(CAPPED))


@pytest.mark.parametrize("name", ["rough.obj", "rough.glb"])
@pytest.mark.parametrize("effort", ["fast", "best"])
def test_a_rough_ball_comes_closer_to_its_reference(name: str, effort: str) -> None:
    answer = refine(rough(name), smooth(), parse_options({"effort": effort}))

    quality = answer.report.quality
    assert answer.report.outcome == "improved"
    assert quality.refined is not None
    assert quality.refined.point_to_surface.mean < 0.5 * quality.input.point_to_surface.mean
    assert answer.name == name.replace("rough", "rough.refined")


def test_the_written_file_is_what_the_report_measures(refinement: Refinement) -> None:
    before, after = read_asset("rough.obj", rough().data), read_asset("", refinement.data)

    moves = np.linalg.norm(after.vertices - before.vertices, axis=1)
    radius = refinement.report.frame.radius
    assert refinement.report.displacement.max == pytest.approx(moves.max() / radius)
    assert refinement.report.displacement.mean == pytest.approx(moves.mean() / radius)


def test_no_vertex_goes_farther_than_it_may(refinement: Refinement) -> None:
    assert refinement.report.displacement.max <= 0.02 + 1e-6


def test_the_report_survives_being_written_as_json(refinement: Refinement) -> None:
    assert Report.model_validate_json(refinement.report.model_dump_json()) == refinement.report


def test_the_report_says_what_was_proved(refinement: Refinement) -> None:
    certificate = refinement.report.certificate

    assert certificate is not None
    assert certificate.holds
    assert certificate.optimum.worst <= certificate.tolerance
    assert certificate.cones["max_displacement"] == 66
    assert 0 < certificate.active["max_displacement"] <= 66
    assert not certificate.relaxation_is_optimal


def test_scs_confirms_the_last_round(refinement: Refinement) -> None:
    last = refinement.report.solver.rounds[-1]

    assert refinement.report.solver.confirmed
    assert last.info is not None
    assert last.sizes is not None
    assert last.sizes.cones["max_displacement"] == 66


def test_scs_is_not_asked_where_the_options_say_so() -> None:
    options = parse_options({**CAPPED, "solver": {"certify": False}})

    solver = refine(rough(), smooth(), options).report.solver

    assert not solver.confirmed
    assert all(record.info is None for record in solver.rounds)


def test_the_iteration_table_holds_the_rounds_scs_was_asked_in(refinement: Refinement) -> None:
    solver = refinement.report.solver
    rows = list(csv.DictReader(io.StringIO(diagnostics_csv(solver))))

    logged = [record.round for record in solver.rounds for _ in record.history.get("iter", [])]
    assert [int(row["round"]) for row in rows] == logged
    assert rows[-1]["res_pri"]


def test_the_certificate_holds_the_multipliers_of_active_cones_only(
    refinement: Refinement,
) -> None:
    assert refinement.certificate is not None
    stored = read_certificate(refinement.certificate, "")

    which, values = stored.multipliers["max_displacement"]
    assert set(stored.multipliers) == {"max_displacement"}
    assert values.shape == (len(which), 4)
    assert (stored.tension > 0).sum() == len(which) < 66


def test_the_same_files_give_the_same_bytes(refinement: Refinement) -> None:
    again = refine(rough(), smooth(), parse_options(CAPPED))

    assert (again.data, again.certificate) == (refinement.data, refinement.certificate)


def test_a_mesh_that_cannot_come_closer_is_kept_byte_for_byte() -> None:
    ball = smooth()

    answer = refine(MeshFile("same.obj", ball.data), ball, parse_options({"effort": "best"}))

    assert answer.data == ball.data
    assert answer.report.certificate is None
    assert answer.report.outcome == "indistinguishable"
    assert "returned as it was" in answer.report.warnings[-1].words


def test_progress_goes_forward_through_every_stage() -> None:
    seen: list[Progress] = []

    refine(rough(), smooth(), parse_options({"effort": "fast"}), seen.append)

    fractions = [progress.fraction for progress in seen]
    assert fractions == sorted(fractions)
    assert list(dict.fromkeys(progress.stage for progress in seen)) == [
        *("read", "solve", "write", "quality")
    ]
    assert seen[-1].round == seen[-1].rounds > 0
