"""Finding and counting jobs, without changing any."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from worker.jobs.ledger_keys import (
    FETCHES,
    PROJECTS,
    all_jobs,
    counters,
    index_of,
    job_keys,
    since,
)
from worker.jobs.records import JobRecord, JobState, Verdict

if TYPE_CHECKING:
    from redis import Redis

_FETCHED_AT_ONCE = 100
_SCANNED_PER_PAGE = 1000  # bounds the work of a filter that matches little


@dataclass(frozen=True)
class JobPage:
    """Some jobs, newest first.

    Attributes:
        cursor: what to pass for the jobs after these; None if there are none. A page of a
            filtered list can be short of its limit and still have a cursor.
    """

    jobs: tuple[JobRecord, ...]
    cursor: str | None


@dataclass(frozen=True)
class JobFilter:
    """Which jobs are meant: those that have all of what is given.

    Attributes:
        project: whose jobs; None for those of all projects.
        name: part of the name of a file that was sent, or of a label, in any case.
    """

    state: JobState | None = None
    verdict: Verdict | None = None
    labels: frozenset[str] = frozenset()
    name: str = ""
    project: str | None = None

    def index(self) -> str:
        """The smallest index certain to hold all of them."""
        if self.labels:
            return index_of("label", min(self.labels), self.project)
        if self.verdict is not None:
            return index_of("verdict", self.verdict, self.project)
        if self.state is not None:
            return index_of("state", self.state, self.project)
        return all_jobs(self.project)

    def admits(self, record: JobRecord) -> bool:
        """Whether a job is meant."""
        return (
            self.project in (None, record.project)
            and self.state in (None, record.state)
            and self.verdict in (None, record.verdict)
            and self.labels.issubset(record.labels)
            and self._is_named(record)
        )

    def _is_named(self, record: JobRecord) -> bool:
        part = self.name.casefold()
        names = [*record.labels, *(file.name for file in record.files)]
        return not part or any(part in name.casefold() for name in names)


EVERYTHING = JobFilter()


class JobIndex:
    """The jobs of a ledger, by time, state, label and verdict.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client

    def page(
        self, limit: int, *, cursor: str | None = None, wanted: JobFilter = EVERYTHING
    ) -> JobPage:
        """Up to ``limit`` of the jobs that are wanted, newest first, without their options.

        The order is that of creation, so a job keeps its place while the list is walked.

        Args:
            limit: positive.
            cursor: the id of the last job seen.
            wanted: which jobs to list.
        """
        index = wanted.index()
        found: list[JobRecord] = []
        for scanned, record in enumerate(self._newest_first(index, cursor), start=1):
            if wanted.admits(record):
                found.append(record)
            if len(found) == limit or scanned == _SCANNED_PER_PAGE:
                more = self._ids_after(index, record.id, 1)
                return JobPage(tuple(found), record.id if more else None)
        return JobPage(tuple(found), None)

    def projects(self) -> list[str]:
        """The projects there are or were jobs of."""
        return sorted(str(name) for name in self._client.smembers(PROJECTS))

    def count(self, state: JobState, project: str | None = None) -> int:
        """Jobs that are in a state; those whose files have expired are no longer counted.

        Args:
            state: the state.
            project: whose jobs; None for those of all projects, here and below.
        """
        return int(self._client.zcard(since(state, project)))

    def longest(self, state: JobState, project: str | None = None) -> float:
        """Seconds for which the job that has been in a state longest has been so; 0 if none is."""
        oldest = self._client.zrange(since(state, project), 0, 0, withscores=True)
        return max(0.0, self._time() - float(oldest[0][1])) if oldest else 0.0

    def in_state_for(self, state: JobState | str, seconds: float, limit: int = 1000) -> list[str]:
        """Ids of jobs that have been in a state, or ``expired``, for longer; longest first."""
        earliest = self._time() - seconds
        ids = self._client.zrange(since(state), "-inf", earliest, byscore=True, offset=0, num=limit)
        return [str(job_id) for job_id in ids]

    def incomplete(self) -> set[str]:
        """Ids of queued jobs some of whose files are still to be fetched."""
        return {str(job_id) for job_id in self._client.zrange(FETCHES, 0, -1)}

    def counters(self, project: str | None = None) -> Mapping[str, float]:
        """What has happened since the ledger was begun.

        ``transitions:FROM:TO`` counts steps (FROM is empty for a new job), ``seconds:STATE``
        adds up how long jobs were in a state they have left, ``failures:KIND`` counts jobs
        that failed, ``expired`` and ``deleted`` what their names say. Others are of whoever
        passes them to a step.
        """
        found = self._client.hgetall(counters(project))
        return {str(name): float(value) for name, value in found.items()}

    def _time(self) -> float:
        seconds, microseconds = self._client.time()
        return float(seconds) + float(microseconds) / 1e6

    def _newest_first(self, index: str, cursor: str | None) -> Iterator[JobRecord]:
        names = JobRecord.listed_fields()
        while ids := self._ids_after(index, cursor, _FETCHED_AT_ONCE):
            pipeline = self._client.pipeline(transaction=False)
            for job_id in ids:
                pipeline.hmget(job_keys(job_id)[0], names)
            for values in pipeline.execute():
                fields = {
                    name: value
                    for name, value in zip(names, values, strict=True)
                    if value is not None
                }
                if fields:
                    yield JobRecord.decoded(fields)
            cursor = ids[-1]

    def _ids_after(self, index: str, cursor: str | None, count: int) -> list[str]:
        start = "+" if cursor is None else f"({cursor}"
        ids = self._client.zrevrangebylex(index, start, "-", start=0, num=count)
        return [str(job_id) for job_id in ids]
