"""The ledger: the one owner of every job's state.

    queued ──begin──▶ running ──succeed──▶ succeeded ─┐
      │ ▲                ├─────fail──────▶ failed ────┼─expire─▶ (expired) ──▶ deleted
      │ └─retry, hand_back                            │             ▲
      └─────cancel───────┴─────────────▶ canceled ────┴───delete────┘

A running job belongs to an *attempt*. Whoever works on it must name the attempt it began,
so that a work horse thought dead cannot speak for a job another one has taken up.
RQ only carries job ids to workers; what RQ believes about a job decides nothing.

A queued job can be *incomplete*: some of its files are still to be fetched. Nobody begins it
before :meth:`Ledger.complete` has said what they are.

A running job is canceled in two steps: :meth:`Ledger.cancel` asks, and whatever step its
attempt takes next ends it as canceled.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Literal

from meshcone.options import OPTIONS_VERSION
from worker.jobs import errors
from worker.jobs import ledger_scripts as scripts
from worker.jobs import step_scripts as steps
from worker.jobs.durability import DurableWrites
from worker.jobs.idempotency import BoundKey
from worker.jobs.index import JobIndex
from worker.jobs.ledger_keys import job_keys
from worker.jobs.records import (
    FILE_FIELDS,
    Artifact,
    JobError,
    JobProgress,
    JobRecord,
    JobState,
    Output,
    Verdict,
)
from worker.jobs.summaries import JobSummary

if TYPE_CHECKING:
    from redis import Redis
    from redis.commands.core import Script


class Ledger:
    """Jobs in Redis; ``index`` finds and counts them.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client
        self._durable = DurableWrites(client)
        self.index = JobIndex(client)
        self._create = client.register_script(scripts.CREATE)
        self._transition = client.register_script(scripts.TRANSITION)
        self._fetched = client.register_script(scripts.FETCHED)
        self._note_output = client.register_script(scripts.NOTE_OUTPUT)
        self._progress = client.register_script(scripts.PROGRESS)
        self._cancel = client.register_script(scripts.CANCEL)
        self._expire = client.register_script(scripts.EXPIRE)
        self._delete = client.register_script(scripts.DELETE)

    def create(
        self, record: JobRecord, *, capacity: int | None = None, key: BoundKey | None = None
    ) -> str:
        """Enter a queued job, and return its id.

        Args:
            record: the job.
            capacity: how many jobs may be queued, as :meth:`JobIndex.has_room` takes it; None
                for any number.
            key: what the sender calls the request, so that repeating it makes one job. The
                id is then that of the job it made first.

        Raises:
            TransitionRefusedError: its id is taken.
            QueueFullError: there is no room.
            KeyReusedError: the key is of another request.
            redis.TimeoutError: the broker did not say in time that the job is on its disk.
        """
        step = record.entry()
        if capacity is not None:
            step["capacity"] = capacity
        keys = [*job_keys(record.id)]
        if key is not None:
            keys.append(key.place)
            step |= {"fingerprint": key.fingerprint, "remembered": key.remembered}
        answer, found, attempt = self._durable.run(self._create, keys, [json.dumps(step)])
        if answer == steps.REPEATED:
            return str(found)
        if answer == steps.MISMATCHED:
            raise errors.KeyReusedError(found)
        if answer == steps.FULL:
            raise errors.QueueFullError
        errors.accept(record.id, answer, found, attempt)
        return record.id

    def get(self, job_id: str) -> JobRecord:
        """One job.

        Raises:
            UnknownJobError: there is none of that id.
        """
        fields = self._client.hgetall(job_keys(job_id)[0])
        if not fields:
            raise errors.UnknownJobError(job_id)
        return JobRecord.decoded({str(name): str(value) for name, value in fields.items()})

    def begin(self, job_id: str, knows: int = OPTIONS_VERSION) -> int:
        """Start the next attempt of a queued job and return its number, counted from 1.

        Args:
            job_id: the job.
            knows: the highest version of options that whoever begins it can read.

        Raises:
            UnknownJobError: there is no such job.
            TransitionRefusedError: it is not queued, or incomplete.
            TooNewError: its options are newer; it stays queued, and no attempt is counted.
        """
        fields = {"started": _now(), "progress": None}
        return self._step(
            job_id, "queued", None, "running", fields, starts=1, knows=knows, incomplete=False
        )[1]

    def complete(self, record: JobRecord) -> None:
        """Enter what the files of an incomplete job are; it can be begun from now on.

        Args:
            record: the job, all of whose files are in the blob store.

        Raises:
            UnknownJobError: there is no such job.
            TransitionRefusedError: it is queued no more, or not incomplete.
        """
        document = record.model_dump(mode="json")
        fields = {name: document[name] for name in FILE_FIELDS} | {"progress": None}
        step = {
            "id": record.id,
            "fields": {name: json.dumps(value) for name, value in fields.items()},
            "digests": sorted({file.digest for file in record.stored_files}),
        }
        errors.accept(record.id, *self._run(self._fetched, record.id, step))

    def fail_incomplete(self, job_id: str, error: JobError) -> None:
        """End a job whose files cannot be had; refused as :meth:`complete` is."""
        fields = {"finished": _now(), "progress": None, "error": error.model_dump(mode="json")}
        counters = {f"failures:{error.kind}": 1}
        self._step(job_id, "queued", None, "failed", fields, counters=counters, incomplete=True)

    def report_progress(self, job_id: str, attempt: int, progress: JobProgress) -> None:
        """Note how far an attempt has come.

        Raises:
            UnknownJobError: there is no such job.
            TransitionRefusedError: the job is no longer running at this attempt.
            CancelRequestedError: the attempt is to stop; :meth:`end_canceled` ends it.
        """
        step = {"id": job_id, "attempt": attempt, "progress": progress.model_dump_json()}
        answer, state, found = self._run(self._progress, job_id, step)
        if answer == steps.CANCEL_REQUESTED:
            raise errors.CancelRequestedError(job_id)
        errors.accept(job_id, answer, state, found)

    def succeed(
        self,
        job_id: str,
        attempt: int,
        artifacts: Mapping[str, Artifact],
        *,
        verdict: Verdict | None = None,
        summary: JobSummary | None = None,
        judgement: str | None = None,
        timings: Mapping[str, float] | None = None,
        counters: Mapping[str, float] | None = None,
    ) -> JobState:
        """End an attempt with what it made; refused as :meth:`report_progress` is.

        Args:
            job_id: the job.
            attempt: which attempt speaks.
            artifacts: the files, which are in the blob store.
            verdict: what the gates say, if there were any.
            summary: what its report says, in short.
            judgement: what the report says of the gates, to be kept with the job's batch if it
                has one.
            timings: seconds each stage took.
            counters: amounts to add to the ledger's counters if the step is taken.

        Returns:
            ``succeeded``; or ``canceled``, if somebody asked for that meanwhile: nothing of
            what the attempt made is kept then.
        """
        made = {name: artifact.model_dump(mode="json") for name, artifact in artifacts.items()}
        done = JobProgress.done(self.get(job_id).progress)
        fields = {
            "finished": _now(),
            "progress": done.model_dump(mode="json"),
            "artifacts": made,
            "verdict": verdict,
            "summary": None if summary is None else summary.model_dump(mode="json"),
            "timings": dict(timings or {}),
        }
        digests = sorted({artifact.digest for artifact in artifacts.values()})
        more: dict[str, Any] = {"digests": digests, "counters": dict(counters or {})}
        if verdict is not None:
            more["verdict"] = verdict
        if judgement is not None:
            more["judgement"] = judgement
        return self._step(job_id, "running", attempt, "succeeded", fields, **more)[0]

    def fail(self, job_id: str, attempt: int, error: JobError) -> JobState:
        """End an attempt, and the job, with an error; refused as :meth:`report_progress` is.

        Returns:
            ``failed``; or ``canceled``, if somebody asked for that meanwhile.
        """
        fields = {"finished": _now(), "error": error.model_dump(mode="json")}
        counters = {f"failures:{error.kind}": 1}
        return self._step(job_id, "running", attempt, "failed", fields, counters=counters)[0]

    def retry(self, job_id: str, attempt: int) -> JobState:
        """Give up an attempt, but not the job; refused as :meth:`report_progress` is.

        Returns:
            ``queued``; or ``canceled``, if somebody asked for that meanwhile.
        """
        fields = {"started": None, "progress": None}
        return self._step(job_id, "running", attempt, "queued", fields)[0]

    def hand_back(self, job_id: str, attempt: int) -> JobState:
        """Give up an attempt through no fault of the job's: it is not counted.

        Refused as :meth:`report_progress` is; returns what :meth:`retry` returns.
        """
        handed_back = self.get(job_id).handed_back + 1
        fields = {"started": None, "progress": None, "handed_back": handed_back}
        return self._step(job_id, "running", attempt, "queued", fields)[0]

    def cancel(self, job_id: str) -> JobState:
        """Cancel a queued job, or ask the attempt of a running one to stop. Repeatable.

        Returns:
            ``canceled``; or ``running``, if the attempt has still to notice. It cannot end
            but as canceled any more.

        Raises:
            UnknownJobError: there is no such job.
            TransitionRefusedError: it has succeeded or failed.
        """
        step = {"id": job_id, "finished": json.dumps(_now())}
        return errors.accept(job_id, *self._run(self._cancel, job_id, step))[0]

    def end_canceled(self, job_id: str, attempt: int) -> None:
        """End an attempt that was asked to stop; refused as :meth:`report_progress` is."""
        self._step(job_id, "running", attempt, "canceled", {"finished": _now(), "progress": None})

    def note_output(self, job_id: str, name: str, output: Output) -> None:
        """Note what has become of a result that is to be put somewhere.

        Raises:
            UnknownJobError: there is no such job.
            TransitionRefusedError: it has no outputs.
        """
        step: dict[str, Any] = {
            "id": job_id,
            "name": name,
            "output": output.model_dump(mode="json", exclude_none=True),
        }
        if output.state != "waiting":
            step["outcome"] = output.state
        errors.accept(job_id, *self._run(self._note_output, job_id, step))

    def expire(self, job_id: str) -> None:
        """Let go of all files of a job that has ended; its record stays. Repeatable.

        Raises:
            UnknownJobError: there is no such job.
            TransitionRefusedError: it has not ended.
        """
        step = {"id": job_id, "expired": json.dumps(_now())}
        errors.accept(job_id, *self._run(self._expire, job_id, step))

    def delete(self, job_id: str) -> list[str]:
        """Forget a job that has ended, and let go of its files; refused as :meth:`expire` is.

        Returns:
            Names in the file store that nobody needs any more.
        """
        step = json.dumps({"id": job_id})
        answer, state, attempt, doomed = self._delete([*job_keys(job_id)], [step])
        errors.accept(job_id, answer, state, attempt)
        return list(doomed)

    def _step(
        self,
        job_id: str,
        start: JobState,
        attempt: int | None,
        end: JobState,
        fields: Mapping[str, Any],
        **more: Any,
    ) -> tuple[JobState, int]:
        step: dict[str, Any] = {
            "id": job_id,
            "from": start,
            "to": end,
            "starts": 0,
            "finished": json.dumps(_now()),
            "fields": {name: json.dumps(value) for name, value in fields.items()},
            "digests": [],
            "counters": {},
            **more,
        }
        if attempt is not None:
            step["attempt"] = attempt
        return errors.accept(job_id, *self._run(self._transition, job_id, step))

    def _run(
        self, script: Script, job_id: str, step: Mapping[str, Any]
    ) -> tuple[int, JobState | Literal[""], int]:
        answer, state, attempt = script([*job_keys(job_id)], [json.dumps(step)])
        return answer, state, attempt


def _now() -> str:
    return datetime.now(UTC).isoformat()
