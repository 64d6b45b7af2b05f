"""A source that was kept has a certificate too: of closeness, and that it is the source."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from meshcone.files import MeshFile
from meshcone.verbs.replay import verify_by_replay
from meshcone.verbs.verify import verify
from tests.unit.engine.evidence import Evidence
from tests.unit.engine.pairs import rough, smooth

NO_ROUND: dict[str, Any] = {"effort": "fast", "surface": {"fairness": []}}


@pytest.fixture(scope="module")
def kept() -> Evidence:
    return Evidence.of(rough(), smooth(), NO_ROUND)


def words_of(evidence: Evidence, *, replay: bool = False) -> dict[str, tuple[bool, str]]:
    stored = MeshFile("certificate.npz", evidence.certificate.to_bytes())
    check = verify_by_replay if replay else verify
    found = check(
        evidence.report, stored, evidence.source, evidence.reference, evidence.refined
    ).checks
    return {check.name: (check.ok, check.words) for check in found}


def test_a_kept_source_is_proven_to_be_as_close_as_it_is(kept: Evidence) -> None:
    words = words_of(kept)

    assert kept.failed() == set()
    assert words["closeness"][1].endswith("proven without a search")
    assert words["kept"] == (True, "the refined file is the source, byte for byte")
    assert words["road"][1] == "the source was kept; that no round is better: not replayed"


def test_a_kept_source_is_replayed(kept: Evidence) -> None:
    assert all(ok for ok, _ in words_of(kept, replay=True).values())


def test_a_mesh_said_to_have_been_kept_and_was_not_fails(kept: Evidence) -> None:
    moved = replace(kept, refined=rough(seed=8)).with_forged_hashes()

    assert "kept" in moved.failed()


def test_a_last_round_of_a_kept_source_fails(kept: Evidence) -> None:
    refined = Evidence.of(rough(), smooth(), {"effort": "fast"})
    claimed = kept.with_report(certificate=refined.report.certificate)

    assert claimed.failed() == {"report"}


def test_an_optimum_left_out_of_the_certificate_fails() -> None:
    refined = Evidence.of(rough(), smooth(), {"effort": "fast"})

    assert {"kept", "report"} <= refined.with_document(round_index=None).failed()
