"""What the API takes and says of a batch."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from service.api.request_schemas import JobRequest
from worker.jobs.batches import BatchCounts, BatchRecord
from worker.jobs.records import JobState, Verdict

BATCHES_PATH = "/v1/batches"
NAME_LENGTH = 200  # characters

BatchVerdict = Literal["error", "fail", "not_tested", "pass"]


class PairRequest(JobRequest):
    """One of a batch's pairs: a job, as it would be sent by itself."""

    name: str | None = Field(
        default=None,
        min_length=1,
        max_length=NAME_LENGTH,
        description="what reports call it, on one line; by default the source's file name",
    )


class BatchHeader(BaseModel):
    """What is common to the pairs of a batch."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str | None = Field(
        default=None,
        min_length=1,
        max_length=NAME_LENGTH,
        description="what the batch is called, on one line",
    )
    labels: tuple[str, ...] = Field(default=(), description="names to find its jobs by")
    options: dict[str, Any] = Field(
        default_factory=dict,
        description="those that are not to be the default; what a pair sets goes before",
    )
    gates: dict[str, Any] | None = Field(
        default=None, description="bounds that hold for every pair without gates of its own"
    )
    webhook: str | None = Field(
        default=None, description="where to say that the last of its jobs has ended"
    )


class BatchRequest(BatchHeader):
    """Many jobs at once, whose files were sent before or are somewhere else."""

    pairs: list[PairRequest] = Field(min_length=1)


class BatchLinks(BaseModel):
    """Where to go from here."""

    self: str
    jobs: str
    cancel: str | None = Field(default=None, description="absent once the batch has ended")
    result: str = Field(description="every pair's verdict, as `meshcone gate --json` writes it")
    junit: str
    sarif: str
    markdown: str


class Batch(BaseModel):
    """Many jobs that were sent together."""

    id: str
    name: str | None
    state: Literal["running", "finished"] = Field(
        description="finished when the last of its jobs has ended, however"
    )
    labels: list[str]
    project: str = Field(description="whose it is")
    created: datetime
    finished: datetime | None
    cancel_requested: datetime | None = Field(description="when it was to be canceled")
    pairs: int = Field(description="jobs that it was sent with")
    counts: dict[JobState, int] = Field(
        description="its jobs by state; those that were deleted are in none"
    )
    verdicts: dict[Verdict, int] = Field(
        description="its jobs that have succeeded and had gates, by verdict"
    )
    verdict: BatchVerdict | None = Field(
        description="once it is finished, the worst of its pairs; `error` where the job of one "
        "failed, was canceled or was deleted; `not_tested` at best where one had no gates; null "
        "where none had"
    )
    links: BatchLinks

    @classmethod
    def of(cls, record: BatchRecord, counts: BatchCounts) -> Self:
        """The public view of a batch."""
        path = batch_path(record.id)
        is_finished = record.finished is not None
        return cls(
            id=record.id,
            name=record.name,
            state="finished" if is_finished else "running",
            labels=list(record.labels),
            project=record.project,
            created=record.created,
            finished=record.finished,
            cancel_requested=record.cancel_requested,
            pairs=record.pairs,
            counts=dict(counts.states),
            verdicts=dict(counts.verdicts),
            verdict=_verdict(record, counts) if is_finished else None,
            links=BatchLinks(
                self=path,
                jobs=f"{path}/jobs",
                cancel=None if is_finished else f"{path}/cancel",
                result=f"{path}/result",
                junit=f"{path}/junit.xml",
                sarif=f"{path}/sarif.json",
                markdown=f"{path}/summary.md",
            ),
        )


class BatchList(BaseModel):
    """Some batches, newest first."""

    batches: list[Batch]
    next: str | None = Field(description="where the list goes on")


def batch_path(batch_id: str) -> str:
    """The path of a batch."""
    return f"{BATCHES_PATH}/{batch_id}"


def _verdict(record: BatchRecord, counts: BatchCounts) -> BatchVerdict | None:
    """What the result of the batch says too; only there, no gates at all are `not_tested`."""
    if counts.states["succeeded"] < record.pairs:
        return "error"
    judged = sum(counts.verdicts.values())
    if not judged:
        return None
    if counts.verdicts["fail"]:
        return "fail"
    return "pass" if counts.verdicts["pass"] == record.pairs else "not_tested"
