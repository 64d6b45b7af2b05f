"""What the API says of a job."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from pydantic import BaseModel, Field

from service.problems import Problem, problem_of
from worker.records import JobProgress, JobRecord, JobState, StoredFile

JOBS_PATH = "/v1/jobs"


class SentFile(BaseModel):
    """A file as it was received."""

    name: str
    size: int = Field(description="bytes")
    sha256: str

    @classmethod
    def of(cls, file: StoredFile) -> SentFile:
        """The public part of a stored file."""
        return cls(name=file.name, size=file.size, sha256=file.digest)


class JobLinks(BaseModel):
    """Where to go from here; results have links once the job has succeeded."""

    self: str
    mesh: str | None = None
    report: str | None = None
    certificate: str | None = Field(
        default=None, description="absent where the input was kept as it was"
    )
    diagnostics: str | None = None
    diagnostics_csv: str | None = None


class Job(BaseModel):
    """A refinement, from its submission on."""

    id: str
    state: JobState
    attempt: int = Field(description="times it has been started")
    label: str | None
    created: datetime
    started: datetime | None
    finished: datetime | None
    source: SentFile
    reference: SentFile
    resources: list[SentFile]
    options: dict[str, Any] = Field(description="every option with its value")
    progress: JobProgress | None
    error: Problem | None = Field(description="why it failed")
    links: JobLinks

    @classmethod
    def of(cls, record: JobRecord) -> Job:
        """The public view of a ledger's record."""
        return cls(
            id=record.id,
            state=record.state,
            attempt=record.attempt,
            label=record.label,
            created=record.created,
            started=record.started,
            finished=record.finished,
            source=SentFile.of(record.source),
            reference=SentFile.of(record.reference),
            resources=[SentFile.of(file) for file in record.resources],
            options=record.options,
            progress=record.progress,
            error=problem_of(record.error) if record.error else None,
            links=_links(record),
        )


class JobList(BaseModel):
    """Some jobs, newest first."""

    jobs: list[Job]
    next: str | None = Field(
        description="where the list goes on; a filtered page can be short and still have one"
    )


def job_path(job_id: str) -> str:
    """The path of a job."""
    return f"{JOBS_PATH}/{job_id}"


def _links(record: JobRecord) -> JobLinks:
    path = job_path(record.id)
    if record.state != "succeeded":
        return JobLinks(self=path)
    return JobLinks(
        self=path,
        mesh=f"{path}/mesh",
        report=f"{path}/report",
        certificate=f"{path}/certificate" if "certificate" in record.artifacts else None,
        diagnostics=f"{path}/diagnostics",
        diagnostics_csv=f"{path}/diagnostics.csv",
    )
