"""Warnings as records, and as the words that earlier reports have."""

from __future__ import annotations

import json

from meshcone.files import MeshFile
from meshcone.notices import UNCODED, Code, Notice, WarningRecord
from meshcone.options import parse_options
from meshcone.report.report import MeasureReport
from meshcone.verbs.measure import measure
from service.gating.job import Judgement
from tests import shapes

QUICK = parse_options({"mode": "measure", "quality": {"samples": 100, "emd_samples": 16}})


def test_a_readers_notice_becomes_a_warning_that_says_whose_it_is() -> None:
    notice = Notice(Code.FACES_TOO_FEW_CORNERS, "a face with fewer than 3 corners", "line 5")

    warning = notice.about("reference", "crate.obj")

    assert warning.words == "reference crate.obj, line 5: a face with fewer than 3 corners"
    assert (warning.side, warning.where) == ("reference", "line 5")


def test_each_side_of_a_pair_has_its_own_warning() -> None:
    ball = shapes.obj(*shapes.sphere(1)) + b"f 1 2\n"

    report = measure(MeshFile("ball.obj", ball), MeshFile("ball.obj", ball), QUICK)

    corners = [each for each in report.warnings if each.code == "faces.too_few_corners"]
    assert [each.side for each in corners] == ["source", "reference"]


def test_a_report_whose_warnings_are_words_is_read() -> None:
    ball = MeshFile("ball.obj", shapes.obj(*shapes.sphere(1)))
    document = json.loads(measure(ball, ball, QUICK).model_dump_json())
    document["warnings"] = ["The source has 1 face without area."]

    [read] = MeasureReport.model_validate(document).warnings

    assert (read.code, str(read)) == (UNCODED, "The source has 1 face without area.")


def test_a_service_of_an_earlier_version_may_answer_with_words() -> None:
    report = {"gates": {"verdict": "not_tested", "checks": []}, "warnings": ["The ball is open."]}

    [warning] = Judgement.of(report).warnings

    assert warning == WarningRecord(code=UNCODED, side="pair", words="The ball is open.")
