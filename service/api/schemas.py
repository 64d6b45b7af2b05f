"""What the API says of a job."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any, Self
from urllib.parse import quote

from pydantic import BaseModel, Field

from meshcone.options import Mode
from service.problems import Problem, problem_of
from worker.jobs.records import (
    JobFile,
    JobProgress,
    JobRecord,
    JobState,
    Output,
    OutputName,
    OutputState,
    RemoteFile,
    Verdict,
)
from worker.jobs.summaries import JobSummary

JOBS_PATH = "/v1/jobs"
# Where each artifact of a job is, below the job.
_RESULTS = {
    "mesh": "mesh",
    "report": "report",
    "certificate": "certificate",
    "preview": "preview.glb",
    "heatmap": "heatmap.glb",
    "pictures": "pictures.png",
    "thumbnail": "thumbnail.webp",
    "diagnostics_csv": "diagnostics.csv",
}


class JobOutput(BaseModel):
    """A result that is to be put somewhere, and what has become of that."""

    url: str = Field(description="where to, without the query")
    state: OutputState = Field(
        description="waiting for the job's success or for another try; delivered; given_up; or "
        "absent, because the job has made no such file"
    )
    tries: int
    detail: str | None = Field(default=None, description="why it is not there, if it is not")
    finished: datetime | None = Field(default=None, description="when its state became final")

    @classmethod
    def of(cls, output: Output, state: JobState) -> JobOutput:
        """The public part of an output of a job in a state."""
        is_absent = state in ("failed", "canceled")
        return cls(
            url=output.url.partition("?")[0],
            state="absent" if is_absent else output.state,
            tries=output.tries,
            detail=f"the job {state}" if is_absent else output.detail,
            finished=output.finished,
        )


class SentFile(BaseModel):
    """A file of a job, as it was received or as it is to be fetched."""

    name: str
    size: int | None = Field(description="bytes; null until it has been fetched")
    sha256: str | None = Field(description="null until it has been fetched")
    link: str | None = Field(
        default=None,
        description="where to have it again; absent once the job has expired, and until the file "
        "has been fetched",
    )
    url: str | None = Field(
        default=None, description="where it was or is to be fetched from, without the query"
    )

    @classmethod
    def of(cls, file: JobFile, link: str | None) -> SentFile:
        """The public part of a job's file, and where it can be had."""
        if isinstance(file, RemoteFile):
            return cls(name=file.name, size=None, sha256=None, url=file.origin)
        return cls(name=file.name, size=file.size, sha256=file.digest, link=link, url=file.origin)


class JobLinks(BaseModel):
    """Where to go from here; results have links once the job has succeeded."""

    self: str
    events: str | None = Field(default=None, description="absent once the job has expired")
    cancel: str | None = Field(default=None, description="absent once the job has ended")
    mesh: str | None = Field(default=None, description="absent where nothing was refined")
    report: str | None = None
    certificate: str | None = Field(
        default=None,
        description="absent where nothing was refined, or nothing proven of a kept input",
    )
    preview: str | None = Field(
        default=None, description="a light copy of input, refined mesh and reference, as GLB"
    )
    heatmap: str | None = Field(
        default=None, description="the refined mesh coloured by deviation and tension, as GLB"
    )
    pictures: str | None = Field(
        default=None,
        description="six views of input, refined mesh and reference in their colours, as PNG; "
        "absent where neither file has colours",
    )
    thumbnail: str | None = Field(
        default=None,
        description="a small picture of the refined mesh, or of the source where nothing was "
        "refined, as WebP; absent where it could not be drawn",
    )
    diagnostics: str | None = Field(default=None, description="absent where nothing was refined")
    diagnostics_csv: str | None = Field(
        default=None, description="absent where nothing was refined"
    )


class ListedJob(BaseModel):
    """A refinement, a measurement or an audit, as a list shows it: without its options."""

    id: str
    state: JobState
    attempt: int = Field(description="times it has been started")
    labels: list[str]
    project: str = Field(description="whose it is")
    name: str | None = Field(
        default=None, description="what its sender calls it, where it is one of a batch"
    )
    batch: str | None = Field(default=None, description="id of the batch that it belongs to")
    created: datetime
    started: datetime | None
    finished: datetime | None
    needs_newer_worker: datetime | None = Field(
        default=None,
        description="since when it waits for a newer worker: those there are do not know its "
        "options",
    )
    cancel_requested: datetime | None = Field(
        description="when it was to be canceled while it ran; it ends as canceled"
    )
    expires: datetime | None = Field(
        description="when its files go, once it has ended; null where they are kept for ever"
    )
    expired: datetime | None = Field(description="when its files went: there is no result any more")
    source: SentFile
    reference: SentFile | None = Field(
        default=None, description="null where an asset was audited by itself"
    )
    source_resources: list[SentFile] = Field(
        default_factory=list, description="files that only the source names"
    )
    reference_resources: list[SentFile] = Field(
        default_factory=list, description="files that only the reference names"
    )
    resources: list[SentFile] = Field(description="files that either may name")
    mode: Mode | None = Field(
        default=None,
        description="what the options ask for; null for a job of a version that did not note it",
    )
    progress: JobProgress | None
    error: Problem | None = Field(description="why it failed")
    verdict: Verdict | None = Field(description="what the gates say, once it has succeeded")
    summary: JobSummary | None = Field(description="what the report says, in short")
    outputs: dict[OutputName, JobOutput] = Field(
        default_factory=dict, description="results that are to be put somewhere, by name"
    )
    links: JobLinks

    @classmethod
    def of(cls, record: JobRecord, result_ttl: int = 0) -> Self:
        """The public view of a ledger's record.

        Args:
            record: the job.
            result_ttl: seconds the files of a job that has ended are kept; 0 for ever.
        """
        expires = None
        if record.finished is not None and result_ttl:
            expires = record.finished + timedelta(seconds=result_ttl)

        def below(tail: str) -> str | None:
            return None if record.expired else f"{job_path(record.id)}/{tail}"

        def resources(field: str) -> list[SentFile]:
            files: tuple[JobFile, ...] = getattr(record, field)
            return [SentFile.of(file, below(f"{field}/{quote(file.name)}")) for file in files]

        return cls(
            **cls._more(record),
            id=record.id,
            state=record.state,
            attempt=record.attempt,
            labels=list(record.labels),
            project=record.project,
            name=record.name,
            batch=record.batch,
            created=record.created,
            started=record.started,
            finished=record.finished,
            needs_newer_worker=record.needs_newer_worker,
            cancel_requested=record.cancel_requested,
            expires=expires,
            expired=record.expired,
            source=SentFile.of(record.source, below("source")),
            reference=record.reference and SentFile.of(record.reference, below("reference")),
            source_resources=resources("source_resources"),
            reference_resources=resources("reference_resources"),
            resources=resources("resources"),
            mode=record.mode,
            progress=record.progress,
            error=problem_of(record.error) if record.error else None,
            verdict=record.verdict,
            summary=record.summary,
            outputs={
                name: JobOutput.of(output, record.state) for name, output in record.outputs.items()
            },
            links=_links(record),
        )

    @classmethod
    def _more(cls, _record: JobRecord) -> dict[str, Any]:
        return {}


class Job(ListedJob):
    """A refinement, a measurement or an audit, from its submission on."""

    options: dict[str, Any] = Field(description="the options that were set, as they were sent")

    @classmethod
    def _more(cls, record: JobRecord) -> dict[str, Any]:
        return {"options": record.options}


class Deletion(BaseModel):
    """What a deletion of many jobs has come to."""

    deleted: int = Field(description="jobs that are gone")
    not_finished: int = Field(description="jobs that are queued or running, and stay")
    next: str | None = Field(description="the `cursor` with which to go on; null where all is done")


class JobList(BaseModel):
    """Some jobs, newest first."""

    jobs: list[ListedJob]
    next: str | None = Field(
        description="where the list goes on; a filtered page can be short and still have one"
    )


def job_path(job_id: str) -> str:
    """The path of a job."""
    return f"{JOBS_PATH}/{job_id}"


def _links(record: JobRecord) -> JobLinks:
    path = job_path(record.id)
    if record.expired is not None:
        return JobLinks(self=path)
    links = {name: f"{path}/{tail}" for name, tail in _RESULTS.items() if name in record.artifacts}
    if "diagnostics_csv" in links:
        links["diagnostics"] = f"{path}/diagnostics"
    if not record.has_ended:
        links["cancel"] = f"{path}/cancel"
    return JobLinks(self=path, events=f"{path}/events", **links)
