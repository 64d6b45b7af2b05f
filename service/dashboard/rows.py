"""What the table of jobs is made of: jobs that were sent by themselves, and batches.

A batch is one row, however many jobs it has. A search, *failures first* and a look into one batch
list jobs, those of batches too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from service.api.batch_schemas import Batch
from service.api.schemas import ListedJob
from worker.jobs.batches import BatchCounts, Batches, BatchRecord
from worker.jobs.filters import JobFilter
from worker.jobs.index import JobIndex, JobPage, Order

_BATCHES_AT_ONCE = 50
_LOOKED_AT = 200  # batches of a page: bounds the work of a filter that few of them pass

# What a row of the table is made of: a seventh of a job.
_JOB: dict[str, Any] = {
    **dict.fromkeys(
        (
            "id",
            "state",
            "labels",
            "project",
            "created",
            "mode",
            "progress",
            "verdict",
            "expired",
            "batch",
            "name",
        ),
        True,
    ),
    "source": {"name"},
    "reference": {"name"},
    "error": {"detail"},
    "links": {"thumbnail"},
    "summary": {
        "outcome": True,
        "radius": True,
        "worst": True,
        "metrics": {"point_to_surface.max"},
    },
}


@dataclass(frozen=True, eq=False)
class Row:
    """A line of the table; the same object as long as nothing of it changes."""

    entry: ListedJob | Batch

    @cached_property
    def shown(self) -> dict[str, Any]:
        """What a page is told of it: a batch is known by its ``pairs``."""
        shape = None if isinstance(self.entry, Batch) else _JOB
        return self.entry.model_dump(mode="json", include=shape)


@dataclass(frozen=True)
class RowPage:
    """Some jobs and batches.

    Attributes:
        cursor: place of those after these; None if there are none.
    """

    entries: tuple[ListedJob | Batch, ...]
    cursor: str | None


@dataclass(frozen=True)
class Rows:
    """Reads the table.

    Attributes:
        result_ttl: seconds the files of a job that has ended are kept; 0 for ever.
    """

    index: JobIndex
    batches: Batches
    result_ttl: int

    def page(
        self, limit: int, *, cursor: str | None, wanted: JobFilter, order: Order = "newest"
    ) -> RowPage:
        """Up to ``limit`` rows.

        Args:
            limit: positive.
            cursor: of the page before.
            wanted: the jobs that are listed; a batch is, where it has some of these.
            order: of the rows.
        """
        if order == "failures":
            return self._jobs(self.index.failures_first(limit, cursor=cursor, wanted=wanted))
        if wanted.name or wanted.batch is not None:
            return self._jobs(self.index.page(limit, cursor=cursor, wanted=wanted))
        alone = self._jobs(
            self.index.page(limit, cursor=cursor, wanted=replace(wanted, alone=True))
        )
        batches = self._batches(limit, cursor, wanted)
        return _merged(alone, batches, limit)

    def tally(self, wanted: JobFilter) -> dict[str, int]:
        """Jobs by state and verdict, of these labels and this batch, whatever else is filtered."""
        return self.index.tally(wanted.labels, wanted.project, wanted.batch)

    def _jobs(self, page: JobPage) -> RowPage:
        jobs = tuple(ListedJob.of(record, self.result_ttl) for record in page.jobs)
        return RowPage(jobs, page.cursor)

    def _batches(self, limit: int, cursor: str | None, wanted: JobFilter) -> RowPage:
        found: list[ListedJob | Batch] = []
        for _ in range(_LOOKED_AT // _BATCHES_AT_ONCE):
            page = self.batches.page(_BATCHES_AT_ONCE, cursor=cursor, project=wanted.project)
            cursor = page.cursor
            for batch in self._with_jobs(page.batches, wanted):
                if len(found) == limit:
                    return RowPage(tuple(found), found[-1].id)
                found.append(batch)
            if cursor is None:
                break
        return RowPage(tuple(found), cursor)

    def _with_jobs(self, records: tuple[BatchRecord, ...], wanted: JobFilter) -> Iterator[Batch]:
        """Of some batches those that have a job that is wanted."""
        counts = self.batches.counts_of(records) if records else []
        for record, each in zip(records, counts, strict=True):
            if wanted.labels.issubset(record.labels):
                having = {"all": record.pairs} | _by_name(each)
            else:  # a pair can have labels that its batch has not
                having = self.index.tally(wanted.labels, batch=record.id)
            if all(having[value or "all"] for value in (wanted.state, wanted.verdict)):
                yield Batch.of(record, each)


def _by_name(counts: BatchCounts) -> dict[str, int]:
    both = (counts.states, counts.verdicts)
    return {str(name): count for each in both for name, count in each.items()}


def _merged(first: RowPage, second: RowPage, limit: int) -> RowPage:
    """Both, newest first, as far as neither has more in between."""
    seen_to = max((page.cursor for page in (first, second) if page.cursor is not None), default="")
    entries = sorted([*first.entries, *second.entries], key=lambda entry: entry.id, reverse=True)
    shown = [entry for entry in entries if entry.id >= seen_to]
    if len(shown) > limit:
        return RowPage(tuple(shown[:limit]), shown[limit - 1].id)
    return RowPage(tuple(shown), seen_to or None)
