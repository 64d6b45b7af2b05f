"""Finding and counting jobs, without changing any; and keeping the places where they are found."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

from pydantic import ValidationError

from worker.jobs.filters import EVERYTHING, JobFilter
from worker.jobs.identifiers import DEFAULT_PROJECT
from worker.jobs.ledger_keys import (
    FETCHES,
    PLACED,
    PROJECTS,
    all_jobs,
    counters,
    index_of,
    job_keys,
    since,
)
from worker.jobs.lines import HAS_ROOM
from worker.jobs.project_scripts import PLACE
from worker.jobs.records import AttemptRecord, JobRecord, JobState, Verdict

if TYPE_CHECKING:
    from redis import Redis

_FETCHED_AT_ONCE = 100
_SCANNED_PER_PAGE = 1000  # bounds the work of a filter that matches little

_SPARED = frozenset({"progress", "mode", "summary"})
"""Fields without which nothing false is said of a job."""

logger = logging.getLogger(__name__)

Order = Literal["newest", "failures"]
"""In which order jobs are listed: by age alone, or those that failed before the others."""


@dataclass(frozen=True)
class JobPage:
    """Some jobs, newest first.

    Attributes:
        cursor: what to pass for the jobs after these; None if there are none. A page of a
            filtered list can be short of its limit and still have a cursor.
    """

    jobs: tuple[JobRecord, ...]
    cursor: str | None


class JobIndex:
    """The jobs of a ledger, by time, state, label and verdict.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client
        self._has_room = client.register_script(HAS_ROOM)
        self._place = client.register_script(PLACE)

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

    def failures_first(
        self, limit: int, *, cursor: str | None = None, wanted: JobFilter = EVERYTHING
    ) -> JobPage:
        """As :meth:`page`, part by part of :meth:`JobFilter.troubles_first`, each newest first.

        A job that ends while the list is walked may be seen twice or not at all.

        Args:
            limit: positive.
            cursor: of the page before: the rank of a part and the id of the last job seen in it.
            wanted: which jobs to list.
        """
        rank, after = (0, None) if cursor is None else _place(cursor)
        found: list[JobRecord] = []
        seen = cursor
        for part, narrowed in wanted.troubles_first():
            if part < rank:
                continue
            # One more than fits tells whether there are more, in this part or in another.
            page = self.page(
                limit + 1 - len(found), cursor=after if part == rank else None, wanted=narrowed
            )
            for record in page.jobs:
                if len(found) == limit:
                    return JobPage(tuple(found), seen)
                found.append(record)
                seen = f"{part}:{record.id}"
            if page.cursor is not None:
                return JobPage(tuple(found), f"{part}:{page.cursor}")
        return JobPage(tuple(found), None)

    def known(self, ids: Sequence[str]) -> list[JobRecord]:
        """Those of some jobs that there are, in the same order, without their options.

        Of a job that a newer version has moved on, what this one cannot read is left out: how far
        it has come, its mode, its summary; or the whole job, which the log then says.
        """
        names = JobRecord.listed_fields()
        pipeline = self._client.pipeline(transaction=False)
        for job_id in ids:
            pipeline.hmget(job_keys(job_id)[0], names)
        found = []
        for values in pipeline.execute():
            fields = {
                name: value for name, value in zip(names, values, strict=True) if value is not None
            }
            record = _readable(fields) if fields else None
            if record is not None:
                found.append(record)
        return found

    def tally(
        self,
        labels: frozenset[str] = frozenset(),
        project: str | None = None,
        batch: str | None = None,
    ) -> dict[str, int]:
        """How many jobs have all of the labels: ``all``, and by state and verdict.

        Args:
            labels: that a job must have.
            project: whose jobs; None for those of all projects.
            batch: of which batch, whatever its project; None for those of any and of none.
        """
        named = [("state", each) for each in get_args(JobState)]
        named += [("verdict", each) for each in get_args(Verdict)]
        place = (project, batch)
        shared = [index_of("label", label, *place) for label in sorted(labels)]
        pipeline = self._client.pipeline(transaction=False)
        for index in [all_jobs(*place), *(index_of(*each, *place) for each in named)]:
            if shared:
                pipeline.zintercard(1 + len(shared), [index, *shared])
            else:
                pipeline.zcard(index)
        values = ["all", *(value for _, value in named)]
        return dict(zip(values, map(int, pipeline.execute()), strict=True))

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

    def in_state(self, state: JobState, limit: int) -> list[str]:
        """Ids of jobs that are in a state, whenever the broker's clock says they entered it."""
        ids = self._client.zrange(since(state), 0, limit - 1)
        return [str(job_id) for job_id in ids]

    def running(self, limit: int) -> list[AttemptRecord]:
        """The attempts of running jobs, those of a newer version too."""
        ids = self.in_state("running", limit)
        pipeline = self._client.pipeline(transaction=False)
        for job_id in ids:
            pipeline.hmget(job_keys(job_id)[0], "state", "attempt", "handed_back")
        found = zip(ids, pipeline.execute(), strict=True)
        return [
            AttemptRecord(job_id, int(attempt or 0), int(handed_back or 0))
            for job_id, (state, attempt, handed_back) in found
            if state == "running"
        ]

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

    def has_room(self, capacity: int, project: str, owner: str | None, jobs: int = 1) -> bool:
        """Whether so many more jobs of a sender may be queued.

        Where more than ``capacity`` would be, those are let in whose project has no more than its
        share of it queued: an equal part for each project that has queued jobs. In the same way
        a project's share is divided between its keys.
        """
        return bool(self._has_room([], [capacity, project, owner or "", jobs]))

    def project_of(self, job_id: str) -> str | None:
        """Whose a job is; None if there is none of that id, which takes as long to tell."""
        state, project = self._client.hmget(job_keys(job_id)[0], "state", "project")
        if state is None:
            return None
        return DEFAULT_PROJECT if project is None else str(json.loads(project))

    def place_by_project(self, jobs: int) -> bool:
        """See to it that the next jobs are found in their project, in turn. Repeatable.

        Jobs of versions without projects are put into the default one; jobs that such a
        version has moved are put where they are now. Those that belong to no batch are put among
        their like.

        Returns:
            Whether there was one of the former: more may follow.
        """
        return bool(self._place([PLACED], [jobs]))

    def _time(self) -> float:
        seconds, microseconds = self._client.time()
        return float(seconds) + float(microseconds) / 1e6

    def _newest_first(self, index: str, cursor: str | None) -> Iterator[JobRecord]:
        while ids := self._ids_after(index, cursor, _FETCHED_AT_ONCE):
            yield from self.known(ids)
            cursor = ids[-1]

    def _ids_after(self, index: str, cursor: str | None, count: int) -> list[str]:
        start = "+" if cursor is None else f"({cursor}"
        ids = self._client.zrevrangebylex(index, start, "-", start=0, num=count)
        return [str(job_id) for job_id in ids]


def _readable(fields: dict[str, str]) -> JobRecord | None:
    try:
        return JobRecord.decoded(fields)
    except ValidationError:
        pass
    try:
        return JobRecord.decoded({name: fields[name] for name in fields if name not in _SPARED})
    except ValidationError as error:
        unread = ", ".join(sorted({str(each["loc"][0]) for each in error.errors() if each["loc"]}))
        logger.warning("job %s is not listed: a newer version wrote its %s", fields["id"], unread)
        return None


def _place(cursor: str) -> tuple[int, str]:
    rank, _, job_id = cursor.partition(":")
    return int(rank), job_id
