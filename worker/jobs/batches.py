"""Batches: many jobs that were sent together, and have a verdict together.

A batch is accepted as a whole. Its jobs are staged beside it, some at a time, and vanish by
themselves if nothing follows. One step then commits the batch: from it on it is known, and
whatever dies, all of its jobs are entered in the ledger, some in each step, by whoever has accepted
it or by the reconciler. Each step takes what it enters out of what is staged, so no job is entered
twice.

The ledger keeps indexes of each batch's jobs as of each project's, and says in the step that ends
the last of them that the batch has ended.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Self, get_args

from pydantic import BaseModel, ConfigDict
from redis.exceptions import OutOfMemoryError

from worker.jobs import batch_scripts as scripts
from worker.jobs import step_scripts as steps
from worker.jobs.durability import DurableWrites
from worker.jobs.errors import (
    KeyReusedError,
    QueueFullError,
    StagedJobsLostError,
    UnknownBatchError,
)
from worker.jobs.identifiers import DEFAULT_PROJECT, earliest_id
from worker.jobs.ledger_keys import (
    BATCHES,
    OPEN_BATCHES,
    all_jobs,
    batch_key,
    batches_of,
    index_of,
    judgements_of,
)
from worker.jobs.records import JobRecord, JobState, Verdict

if TYPE_CHECKING:
    from redis import Redis

    from worker.jobs.idempotency import BoundKey
    from worker.jobs.queue import JobQueue

STAGED_SECONDS = 120
"""How long staged jobs outlive the last of them, if no commit follows."""

_AT_ONCE = 100  # jobs a step; the broker does nothing else meanwhile, for some milliseconds
_STATES: tuple[JobState, ...] = get_args(JobState)
_VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
_PLAIN = frozenset({"finished", "dropped"})  # fields the scripts write themselves


class BatchRecord(BaseModel):
    """One batch.

    Attributes:
        name: what its sender calls it.
        labels: of the batch; its jobs have them too.
        pairs: how many jobs it was sent with.
        dropped: how many of those were canceled before they were entered.
        owner: id of the API key it was sent with; None if it was sent without.
        accounts: sorted sets in which its jobs are counted as the sender's.
        finished: when the last of its jobs had ended.
    """

    model_config = ConfigDict(frozen=True)

    id: str
    created: datetime
    name: str | None = None
    labels: tuple[str, ...] = ()
    pairs: int
    dropped: int = 0
    webhook: str | None = None
    owner: str | None = None
    project: str = DEFAULT_PROJECT
    accounts: tuple[str, ...] = ()
    cancel_requested: datetime | None = None
    finished: datetime | None = None

    def encoded(self) -> dict[str, str]:
        """The record as the fields of a hash; absent values have no field."""
        document = self.model_dump(mode="json", exclude=set(_PLAIN), exclude_none=True)
        return {name: json.dumps(value) for name, value in document.items()}

    @classmethod
    def decoded(cls, fields: Mapping[str, str]) -> Self:
        """The record that :meth:`encoded` and the scripts have written."""
        return cls.model_validate(
            {name: value if name in _PLAIN else json.loads(value) for name, value in fields.items()}
        )


@dataclass(frozen=True)
class BatchCounts:
    """How many jobs of a batch there are, by state and by verdict; deleted ones are in neither."""

    states: Mapping[JobState, int]
    verdicts: Mapping[Verdict, int]

    @classmethod
    def of_queued(cls, pairs: int) -> Self:
        """Those of a batch that has just been accepted."""
        return cls({**dict.fromkeys(_STATES, 0), "queued": pairs}, dict.fromkeys(_VERDICTS, 0))


@dataclass(frozen=True)
class BatchPage:
    """Some batches, newest first.

    Attributes:
        cursor: what to pass for the batches after these; None if there are none.
    """

    batches: tuple[BatchRecord, ...]
    cursor: str | None


class Batches:
    """The batches of a ledger.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client
        self._durable = DurableWrites(client)
        self._commit = client.register_script(scripts.COMMIT)
        self._carry_on = client.register_script(scripts.CARRY_ON)
        self._cancel_on = client.register_script(scripts.CANCEL_ON)
        self._request_cancel = client.register_script(scripts.REQUEST_CANCEL)
        self._forget = client.register_script(scripts.FORGET)

    def stage(self, batch_id: str, jobs: Sequence[JobRecord]) -> None:
        """Keep some jobs of a batch for its commit, after those that were staged before."""
        with self._client.pipeline(transaction=False) as pipeline:
            pipeline.rpush(_entry(batch_id), *(json.dumps(job.entry()) for job in jobs))
            pipeline.expire(_entry(batch_id), STAGED_SECONDS)
            pipeline.execute()

    def unstage(self, batch_id: str) -> None:
        """Forget what was staged of a batch that is not committed."""
        if not self._client.exists(batch_key(batch_id)):
            self._client.delete(_entry(batch_id))

    def commit(self, record: BatchRecord, *, capacity: int, key: BoundKey | None = None) -> str:
        """Accept a batch all of whose jobs are staged, and return its id.

        Args:
            record: the batch.
            capacity: how many jobs may be queued, as :meth:`JobIndex.has_room` takes it.
            key: what the sender calls the request, so that repeating it makes one batch. The
                id is then that of the batch it made first.

        Raises:
            QueueFullError: there is no room for all of its jobs.
            KeyReusedError: the key is of another request.
            StagedJobsLostError: its jobs are staged no more.
            redis.TimeoutError: the broker did not say in time that the batch is on its disk.
        """
        step: dict[str, Any] = {
            "id": record.id,
            "fields": record.encoded(),
            "pairs": record.pairs,
            "capacity": capacity,
            "project": record.project,
            "owner": record.owner or "",
        }
        keys = [batch_key(record.id), _entry(record.id), batches_of(record.project)]
        if key is not None:
            keys.append(key.place)
            step |= {"fingerprint": key.fingerprint, "remembered": key.remembered}
        answer, found = self._durable.run(self._commit, keys, [json.dumps(step)])
        if answer == steps.MISMATCHED:
            raise KeyReusedError(found)
        if answer == steps.FULL:
            raise QueueFullError
        if answer == steps.REFUSED:
            raise StagedJobsLostError(record.id)
        return str(found)

    def carry_on(self, batch_id: str) -> tuple[list[str], bool]:
        """Enter some more jobs of a batch or, where it is to be canceled, cancel some.

        Those that run are asked to stop; they end when their workers have noticed.

        Any number of processes may do so at one time.

        Returns:
            The jobs that wait for nothing but a worker, and whether anything is left to be done.
        """
        step = {"id": batch_id, "count": _AT_ONCE, "finished": json.dumps(_now())}
        place = batch_key(batch_id)
        keys = [place, _entry(batch_id), f"{place}:since:queued", f"{place}:since:running"]
        try:
            ready, more = self._carry_on(keys, [json.dumps(step)])
        except OutOfMemoryError:  # entering jobs takes more of it; canceling them makes room
            if not self._client.hexists(place, "cancel_requested"):
                raise
            ready, more = self._cancel_on(keys, [json.dumps(step)])
        return [str(job_id) for job_id in ready], bool(more)

    def open(self) -> list[str]:
        """Ids of the batches that have not ended."""
        return sorted(str(batch_id) for batch_id in self._client.smembers(OPEN_BATCHES))

    def get(self, batch_id: str) -> BatchRecord:
        """One batch.

        Raises:
            UnknownBatchError: there is none of that id.
        """
        fields = self._client.hgetall(batch_key(batch_id))
        if not fields:
            raise UnknownBatchError(batch_id)
        return BatchRecord.decoded({str(name): str(value) for name, value in fields.items()})

    def page(self, limit: int, *, cursor: str | None, project: str | None) -> BatchPage:
        """Up to ``limit`` batches of a project, or of all, newest first.

        Args:
            limit: positive.
            cursor: the id of the last batch seen.
            project: whose batches; None for those of all projects.
        """
        start = "+" if cursor is None else f"({cursor}"
        found = self._client.zrevrangebylex(batches_of(project), start, "-", start=0, num=limit + 1)
        ids = [str(batch_id) for batch_id in found]
        with self._client.pipeline(transaction=False) as pipeline:
            for batch_id in ids[:limit]:
                pipeline.hgetall(batch_key(batch_id))
            records = [BatchRecord.decoded(fields) for fields in pipeline.execute() if fields]
        return BatchPage(tuple(records), ids[limit - 1] if len(ids) > limit else None)

    def jobless(self, seconds: float) -> Iterator[BatchRecord]:
        """Batches that have finished before a time, and have no jobs any more; oldest first.

        The last of a batch's jobs takes it along. These had none when they finished: all of it was
        canceled before any was entered, or was deleted by then.
        """
        end, after = f"({earliest_id(seconds)}", "-"
        while found := self._client.zrangebylex(BATCHES, after, end, start=0, num=_AT_ONCE):
            ids = [str(batch_id) for batch_id in found]
            after = f"({ids[-1]}"
            for batch_id in ids:
                if self._client.exists(all_jobs(batch=batch_id)):
                    continue
                with suppress(UnknownBatchError):
                    record = self.get(batch_id)
                    if record.finished is not None and record.finished.timestamp() < seconds:
                        yield record

    def counts(self, record: BatchRecord) -> BatchCounts:
        """How its jobs stand now; those that are not entered yet count as queued."""
        [counts] = self.counts_of([record])
        return counts

    def counts_of(self, records: Sequence[BatchRecord]) -> list[BatchCounts]:
        """The same of some batches, asked for at once."""
        with self._client.pipeline(transaction=True) as pipeline:
            for record in records:
                pipeline.llen(_entry(record.id))
                for state in _STATES:
                    pipeline.zcard(index_of("state", state, batch=record.id))
                for verdict in _VERDICTS:
                    pipeline.zcard(index_of("verdict", verdict, batch=record.id))
            found = [int(each) for each in pipeline.execute()]
        width = 1 + len(_STATES) + len(_VERDICTS)
        return [
            _counted(record, found[start : start + width])
            for record, start in zip(records, range(0, len(found), width), strict=True)
        ]

    def job_ids(self, batch_id: str, after: str | None = None, count: int = -1) -> list[str]:
        """Ids of a batch's jobs, in the order in which it was sent."""
        start = "-" if after is None else f"({after}"
        found = self._client.zrangebylex(all_jobs(batch=batch_id), start, "+", start=0, num=count)
        return [str(job_id) for job_id in found]

    def judgements(self, batch_id: str, ids: Sequence[str]) -> list[str | None]:
        """What the reports of some of its jobs say, as JSON; None where that is not kept."""
        found = self._client.hmget(judgements_of(batch_id), list(ids)) if ids else []
        return [None if each is None else str(each) for each in found]

    def request_cancel(self, batch_id: str) -> bool:
        """Have all jobs of a batch canceled by :meth:`carry_on`; whether it had not ended."""
        return bool(self._request_cancel([batch_key(batch_id)], [json.dumps(_now())]))

    def forget(self, batch_id: str) -> bool:
        """Forget a batch that has ended and whose jobs are deleted; whether it is forgotten."""
        keys = [batch_key(batch_id), all_jobs(batch=batch_id)]
        return bool(self._forget(keys, [json.dumps({"id": batch_id})]) == steps.ACCEPTED)


def carry_through(batch_id: str, batches: Batches, queue: JobQueue) -> None:
    """Enter all jobs of a batch, or cancel them, and have those run that can. Repeatable."""
    more = True
    while more:
        ready, more = batches.carry_on(batch_id)
        if ready:
            queue.enqueue(*ready)


def _counted(record: BatchRecord, found: Sequence[int]) -> BatchCounts:
    waiting, states, verdicts = found[0], found[1 : 1 + len(_STATES)], found[1 + len(_STATES) :]
    by_state = dict(zip(_STATES, states, strict=True))
    by_state["queued"] += waiting
    by_state["canceled"] += record.dropped
    return BatchCounts(by_state, dict(zip(_VERDICTS, verdicts, strict=True)))


def _entry(batch_id: str) -> str:
    return f"{batch_key(batch_id)}:entry"


def _now() -> str:
    return datetime.now(UTC).isoformat()
