"""Every hostile file ends in an error of the right kind that says where and what."""

from __future__ import annotations

import re

import pytest

from meshcone.assets import Limits, read_asset
from meshcone.errors import MeshConeError
from tests.hostile import CASES
from tests.hostile.case import Case

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


@pytest.mark.parametrize("case", [c for c in CASES if c.kind != "ok"], ids=str)
def test_a_hostile_file_is_refused(case: Case) -> None:
    with pytest.raises(MeshConeError) as caught:
        read_asset(case.name, case.make(), case.resources, Limits(**case.limits))
    error = caught.value
    assert error.kind == case.kind
    assert error.file == case.name
    assert re.search(case.message, error.message)
    assert len(error.message) < 300
    if case.place is None:
        assert error.place is None
    else:
        assert re.fullmatch(case.place, error.place or "")


@pytest.mark.parametrize("case", [c for c in CASES if c.kind == "ok"], ids=str)
def test_a_file_that_only_looks_hostile_is_read(case: Case) -> None:
    asset = read_asset(case.name, case.make(), case.resources, Limits(**case.limits))
    assert len(asset.faces) > 0


def test_every_case_has_a_title_of_its_own() -> None:
    titles = [str(case) for case in CASES]
    assert len(set(titles)) == len(titles)
