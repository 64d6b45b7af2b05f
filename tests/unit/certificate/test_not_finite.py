"""A number that is none, or infinite, passes no check and is read from no report."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.certificate.file import read_certificate
from meshcone.errors import InputError
from meshcone.json_text import parse_json
from meshcone.verbs.verify import read_report
from tests.unit.certificate.test_file import repacked
from tests.unit.engine.evidence import Evidence

NAN, INFINITY = float("nan"), float("inf")


@pytest.mark.parametrize("text", ["NaN", "-Infinity", "[1e400]", '{"a": -1e999}'])
def test_no_json_has_a_number_that_is_not_finite(text: str) -> None:
    with pytest.raises(ValueError, match=r"is no number that JSON has|too large for a number"):
        parse_json(text)


@pytest.mark.parametrize("number", ["NaN", "1e400"])
def test_a_report_with_such_a_number_is_refused_by_name(honest: Evidence, number: str) -> None:
    radius = f'"radius":{honest.report.frame.radius}'
    text = honest.report.model_dump_json()
    assert radius in text

    with pytest.raises(InputError, match=f"not a MeshCone report: {number} is "):
        read_report(text.replace(radius, f'"radius":{number}').encode(), "report.json")


def test_a_report_that_states_a_number_twice_is_refused_by_name(honest: Evidence) -> None:
    text = honest.report.model_dump_json().replace('"frame":{', '"frame":{"radius":9,', 1)

    with pytest.raises(InputError, match="not a MeshCone report: 'radius' is there twice"):
        read_report(text.encode(), "report.json")


@pytest.mark.parametrize("changes", [{"radius": NAN}, {"centre": (0.0, NAN, 0.0)}])
def test_a_frame_that_is_no_number_fails(honest: Evidence, changes: dict[str, object]) -> None:
    frame = honest.report.frame.model_copy(update=changes)

    assert "frame" in honest.with_report(frame=frame).failed()


@pytest.mark.parametrize("value", [NAN, INFINITY])
@pytest.mark.parametrize("residual", ["primal", "dual", "gap", "complementarity"])
def test_a_residual_that_is_not_finite_fails(honest: Evidence, residual: str, value: float) -> None:
    stated = honest.report.certificate
    assert stated is not None
    written = stated.written.model_copy(update={residual: value})
    forged = stated.model_copy(update={"written": written})

    assert honest.with_report(certificate=forged).failed() == {"report"}


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('{"candidate": "best", ', "its document cannot be used: 'candidate' is there twice"),
        ('{"a": NaN, ', "its document cannot be used: NaN is no number that JSON has"),
    ],
)
def test_a_document_that_says_two_things_is_refused(honest: Evidence, more: str, said: str) -> None:
    text = more + honest.certificate.document.model_dump_json()[1:]
    forged = repacked(honest.certificate.to_bytes(), document=np.array(text))

    with pytest.raises(InputError, match=said):
        read_certificate(forged, "certificate.npz")
