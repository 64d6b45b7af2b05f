from __future__ import annotations

import pytest

from service.api.routes.submit import LONGEST_WAIT, preferred_wait


@pytest.mark.parametrize(
    ("headers", "seconds"),
    [
        (["wait=5"], 5),
        (["respond-async, wait=5"], 5),
        (["respond-async", "Wait = 5"], 5),
        (['wait="5"; strict'], 5),
        (["wait=5, wait=9"], 5),  # the first of several counts (RFC 7240, section 2)
        (["wait=0"], 0),
        (["wait=86400"], LONGEST_WAIT),
    ],
)
def test_a_wait_is_found_among_preferences(headers: list[str], seconds: int) -> None:
    assert preferred_wait(headers) == seconds


@pytest.mark.parametrize(
    "headers", [[], ["wait"], ["wait=-1"], ["wait=soon"], ["await=5"], ["wait=5s"]]
)
def test_what_is_no_wait_is_ignored(headers: list[str]) -> None:
    assert preferred_wait(headers) is None
