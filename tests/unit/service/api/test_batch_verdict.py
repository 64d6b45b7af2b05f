"""The verdict of a batch: never better than that of its worst pair."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest

from service.api.batch_schemas import Batch, BatchVerdict
from worker.jobs.batches import BatchCounts, BatchRecord

NOW = datetime(2030, 1, 1, tzinfo=UTC)
PAIRS = 3


def verdict_of(states: dict[str, int], verdicts: dict[str, int]) -> BatchVerdict | None:
    none = dict.fromkeys(("queued", "running", "succeeded", "failed", "canceled"), 0)
    unjudged = dict.fromkeys(("pass", "fail", "not_tested"), 0)
    counts = BatchCounts({**none, **states}, {**unjudged, **verdicts})  # type: ignore[dict-item]
    record = BatchRecord(id="0", created=NOW, finished=NOW, pairs=PAIRS)
    return Batch.of(record, counts).verdict


@pytest.mark.parametrize(
    ("verdicts", "verdict"),
    [
        ({"pass": 3}, "pass"),
        ({"pass": 2, "not_tested": 1}, "not_tested"),
        ({"pass": 1, "not_tested": 1, "fail": 1}, "fail"),
    ],
)
def test_it_is_that_of_the_worst_pair(verdicts: dict[str, int], verdict: BatchVerdict) -> None:
    assert verdict_of({"succeeded": 3}, verdicts) == verdict


@pytest.mark.parametrize("other", [{"failed": 1}, {"canceled": 1}, {}], ids=str)
def test_a_pair_that_failed_was_canceled_or_was_deleted_is_an_error(other: dict[str, int]) -> None:
    assert verdict_of({"succeeded": 2, **other}, {"pass": 1, "fail": 1}) == "error"


def test_a_pair_without_gates_is_not_tested() -> None:
    assert verdict_of({"succeeded": 3}, {"pass": 2}) == "not_tested"
    assert verdict_of({"succeeded": 3}, {"fail": 1}) == "fail"


def test_without_any_gates_there_is_none() -> None:
    assert verdict_of({"succeeded": 3}, {}) is None
