"""The ledger: the one owner of every job's state.

    queued ──begin──▶ running ──succeed──▶ succeeded
       ▲                 ├─────fail──────▶ failed
       └─────retry───────┘

A running job belongs to an *attempt*. Whoever works on it must name the attempt it began,
so that a work horse thought dead cannot speak for a job another one has taken up.
RQ only carries job ids to workers; what RQ believes about a job decides nothing.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from worker import ledger_scripts
from worker.records import Artifact, JobError, JobProgress, JobRecord, JobState

if TYPE_CHECKING:
    from redis import Redis

_INDEX = "meshcone:jobs"
_PLAIN = frozenset({"id", "state", "attempt"})  # fields the scripts read; the others are JSON
_FETCHED_AT_ONCE = 100
_SCANNED_PER_PAGE = 1000  # bounds the work of a filter that matches little


class UnknownJobError(LookupError):
    """The ledger has no job of that id."""


class TransitionRefusedError(Exception):
    """The job is not in the state, or not at the attempt, that the step starts from."""

    def __init__(self, job_id: str, state: str, attempt: int) -> None:
        super().__init__(f"job {job_id} is {state} at attempt {attempt}")
        self.state = state
        self.attempt = attempt


@dataclass(frozen=True)
class JobPage:
    """Some jobs, newest first.

    Attributes:
        cursor: what to pass for the jobs after these; None if there are none. A page of a
            filtered list can be short of its limit and still have a cursor.
    """

    jobs: tuple[JobRecord, ...]
    cursor: str | None


class Ledger:
    """Jobs in Redis: a hash and a capped stream of events each, and an index of all.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client
        self._create = client.register_script(ledger_scripts.CREATE)
        self._transition = client.register_script(ledger_scripts.TRANSITION)
        self._progress = client.register_script(ledger_scripts.PROGRESS)

    def create(self, record: JobRecord) -> None:
        """Enter a queued job.

        Raises:
            TransitionRefusedError: its id is taken.
        """
        arguments = [record.id, *_encoded(record.model_dump(mode="json"))]
        _accept(record.id, self._create([*_keys(record.id), _INDEX], arguments))

    def get(self, job_id: str) -> JobRecord:
        """One job.

        Raises:
            UnknownJobError: there is none of that id.
        """
        fields = self._client.hgetall(_keys(job_id)[0])
        if not fields:
            raise UnknownJobError(job_id)
        return _decoded(fields)

    def page(
        self,
        limit: int,
        *,
        cursor: str | None = None,
        state: JobState | None = None,
        label: str | None = None,
    ) -> JobPage:
        """Up to ``limit`` jobs, newest first, of those a state and a label select."""
        found: list[JobRecord] = []
        for scanned, record in enumerate(self._newest_first(cursor), start=1):
            if state in (None, record.state) and label in (None, record.label):
                found.append(record)
            if len(found) == limit or scanned == _SCANNED_PER_PAGE:
                more = self._ids_after(record.id, 1)
                return JobPage(tuple(found), record.id if more else None)
        return JobPage(tuple(found), None)

    def begin(self, job_id: str) -> int:
        """Start the next attempt of a queued job and return its number, counted from 1.

        Raises:
            UnknownJobError: there is no such job.
            TransitionRefusedError: it is not queued.
        """
        return self._step(
            job_id, "queued", None, "running", 1, {"started": _now(), "progress": None}
        )

    def report_progress(self, job_id: str, attempt: int, progress: JobProgress) -> None:
        """Note how far an attempt has come.

        Raises:
            UnknownJobError: there is no such job.
            TransitionRefusedError: the job is no longer running at this attempt.
        """
        arguments: list[str | int] = [attempt, progress.model_dump_json()]
        _accept(job_id, self._progress(_keys(job_id), arguments))

    def succeed(self, job_id: str, attempt: int, artifacts: Mapping[str, Artifact]) -> None:
        """End an attempt with what it made; refused as :meth:`report_progress` is."""
        made = {name: artifact.model_dump(mode="json") for name, artifact in artifacts.items()}
        fields = {"finished": _now(), "artifacts": made}
        self._step(job_id, "running", attempt, "succeeded", 0, fields)

    def fail(self, job_id: str, attempt: int, error: JobError) -> None:
        """End an attempt, and the job, with an error; refused as :meth:`report_progress` is."""
        fields = {"finished": _now(), "error": error.model_dump(mode="json")}
        self._step(job_id, "running", attempt, "failed", 0, fields)

    def retry(self, job_id: str, attempt: int) -> None:
        """Give up an attempt, but not the job; refused as :meth:`report_progress` is."""
        fields = {"started": None, "progress": None}
        self._step(job_id, "running", attempt, "queued", 0, fields)

    def _step(
        self,
        job_id: str,
        expected: JobState,
        attempt: int | None,
        new: JobState,
        increment: int,
        fields: Mapping[str, Any],
    ) -> int:
        arguments: list[str | int] = [expected, "" if attempt is None else attempt, new, increment]
        return _accept(job_id, self._transition(_keys(job_id), [*arguments, *_encoded(fields)]))

    def _newest_first(self, cursor: str | None) -> Iterator[JobRecord]:
        while ids := self._ids_after(cursor, _FETCHED_AT_ONCE):
            pipeline = self._client.pipeline(transaction=False)
            for job_id in ids:
                pipeline.hgetall(_keys(job_id)[0])
            yield from (_decoded(fields) for fields in pipeline.execute() if fields)
            cursor = ids[-1]

    def _ids_after(self, cursor: str | None, count: int) -> list[str]:
        # Ids sort by creation time, so the index needs no scores.
        start = "+" if cursor is None else f"({cursor}"
        ids = self._client.zrevrangebylex(_INDEX, start, "-", start=0, num=count)
        return [str(job_id) for job_id in ids]


def _keys(job_id: str) -> tuple[str, str]:
    key = f"meshcone:job:{job_id}"
    return key, f"{key}:events"


def _now() -> str:
    return datetime.now(UTC).isoformat()


def _accept(job_id: str, answer: list[Any]) -> int:
    accepted, state, attempt = answer
    if accepted:
        return int(attempt)
    if not state:
        raise UnknownJobError(job_id)
    raise TransitionRefusedError(job_id, state, int(attempt))


def _encoded(fields: Mapping[str, Any]) -> list[str]:
    arguments: list[str] = []
    for name, value in fields.items():
        arguments += [name, str(value) if name in _PLAIN else json.dumps(value)]
    return arguments


def _decoded(fields: Mapping[Any, Any]) -> JobRecord:
    document = {
        name: value if name in _PLAIN else json.loads(value) for name, value in fields.items()
    }
    return JobRecord.model_validate(document)
