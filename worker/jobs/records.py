"""What the ledger remembers of a job."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict

from meshcone.errors import ErrorKind, MeshConeError
from meshcone.gates.records import Status
from meshcone.options import Mode
from meshcone.progress import Progress, Stage
from worker.jobs.fetch_accounts import ByteAccount
from worker.jobs.identifiers import DEFAULT_PROJECT
from worker.jobs.summaries import JobSummary

JobState = Literal["queued", "running", "succeeded", "failed", "canceled"]
FINAL_STATES: tuple[JobState, ...] = ("succeeded", "failed", "canceled")
Verdict = Status

_PLAIN = frozenset({"id", "state", "attempt"})  # fields the ledger's scripts read as they are


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True)


class StoredFile(_Frozen):
    """A file of a job: its name, and the digest under which the blob store holds it.

    Attributes:
        origin: the URL it was fetched from, without its query; None if it was sent.
    """

    name: str
    digest: str
    size: int
    origin: str | None = None


class RemoteFile(_Frozen):
    """A file of a job that has still to be fetched.

    Attributes:
        url: where it is; what follows a question mark there may be a secret.
        sha256: of the bytes that must be found there, where the sender has said so.
        authorization: the name of the installation's secret to show there.
        resources: ``relative`` if the files that it names are to be fetched from beside it.
    """

    name: str
    url: str
    sha256: str | None = None
    authorization: str | None = None
    resources: Literal["relative"] | None = None

    @property
    def origin(self) -> str:
        """The URL without its query."""
        return self.url.partition("?")[0]


JobFile = StoredFile | RemoteFile
FILE_FIELDS = ("source", "reference", "source_resources", "reference_resources", "resources")
"""Fields of a record that hold files."""


class Artifact(_Frozen):
    """A file a job made."""

    digest: str
    media_type: str
    filename: str
    size: int


OutputName = Literal[
    "mesh", "report", "certificate", "preview", "heatmap", "pictures", "diagnostics_csv"
]
"""What a job can be asked to put somewhere: its artifacts, by name."""

OutputState = Literal["waiting", "delivered", "given_up", "absent"]
"""What can become of an output; ``absent`` is what the job has not made."""


class Output(_Frozen):
    """Where a sender wants a result to be put, and what has become of that.

    Attributes:
        url: where to; what follows a question mark there may be a secret.
        authorization: the name of the installation's secret to show there.
        tries: how often it was tried.
        detail: why it is not there, if it is not.
        finished: when its state became final.
    """

    url: str
    authorization: str | None = None
    state: OutputState = "waiting"
    tries: int = 0
    detail: str | None = None
    finished: datetime | None = None

    def ended(self, state: OutputState, detail: str | None) -> Output:
        """The same output in its last state, without what only a try needs to know."""
        return self.model_copy(
            update={
                "url": self.url.partition("?")[0],
                "state": state,
                "detail": detail,
                "finished": datetime.now(UTC),
            }
        )


class JobProgress(_Frozen):
    """How far a job has come; see :class:`meshcone.progress.Progress`.

    One whose files are being fetched is ``fetching``, and queued; a succeeded one is ``done``.
    """

    stage: Stage | Literal["fetching", "done"]
    round: int
    rounds: int
    fraction: float

    @classmethod
    def of(cls, progress: Progress) -> JobProgress:
        """The record of an engine's report."""
        return cls(
            stage=progress.stage,
            round=progress.round,
            rounds=progress.rounds,
            fraction=progress.fraction,
        )

    @classmethod
    def fetching(cls) -> JobProgress:
        """The beginning of a job whose files are somewhere else."""
        return cls(stage="fetching", round=0, rounds=0, fraction=0.0)

    @classmethod
    def done(cls, last: JobProgress | None) -> JobProgress:
        """The end, after the last report there was."""
        rounds = 0 if last is None else last.rounds
        return cls(stage="done", round=rounds, rounds=rounds, fraction=1.0)


class JobError(_Frozen):
    """Why a job failed, in words for the person who sent it."""

    kind: ErrorKind
    message: str
    file: str | None = None
    place: str | None = None

    @classmethod
    def of(cls, error: MeshConeError) -> JobError:
        """The public part of an error."""
        return cls(kind=error.kind, message=error.message, file=error.file, place=error.place)


@dataclass(frozen=True)
class AttemptRecord:
    """What has to be known of a job to see to its attempt, whatever version has written the job.

    Attributes: those of :class:`JobRecord`.
    """

    id: str
    attempt: int
    handed_back: int


class JobRecord(_Frozen):
    """One job.

    Attributes:
        attempt: how often it has been started.
        handed_back: how many of those starts were given up by a worker that was stopped.
        expired: when its files were let go.
        cancel_requested: when somebody asked for it to be canceled while it was running.
        reference: None where an asset is audited by itself.
        source_resources: files that only the source names.
        reference_resources: files that only the reference names.
        resources: files that either may name.
        mode: what its options ask for; None in a record from before this was noted.
        options: the options that were set, as the sender set them; empty in a list.
        options_version: of the program that took them in; see :mod:`meshcone.options.version`.
        needs_newer_worker: when a worker first left it to one that knows newer options, if it
            still waits for one.
        webhook: where to say that it has ended.
        outputs: where to put what it makes once it has succeeded, by the artifact's name.
        owner: id of the API key it was sent with; None if it was sent without.
        project: whose it is: only keys of the project learn that there is such a job.
        name: what its sender calls it, where it is one of a batch.
        batch: the batch it belongs to.
        fetch_accounts: against which the bytes are counted that are fetched for it.
        context: what its log lines and its trace begin with: ``request_id`` and the fields of
            W3C Trace Context.
        artifacts: what it made, by name: ``report``, ``preview`` and, of a refinement, ``mesh``,
            ``diagnostics_csv``, ``heatmap`` and, unless the input was kept, ``certificate``; of
            coloured files ``pictures``; mostly a ``thumbnail`` too.
        verdict: what the gates say of it, if there were any.
        summary: the few numbers of its report that a list of jobs shows.
        timings: seconds each stage took, once it has succeeded.
    """

    id: str
    state: JobState = "queued"
    attempt: int = 0
    handed_back: int = 0
    created: datetime
    started: datetime | None = None
    finished: datetime | None = None
    expired: datetime | None = None
    cancel_requested: datetime | None = None
    labels: tuple[str, ...] = ()
    source: JobFile
    reference: JobFile | None = None
    source_resources: tuple[JobFile, ...] = ()
    reference_resources: tuple[JobFile, ...] = ()
    resources: tuple[JobFile, ...] = ()
    mode: Mode | None = None
    options: dict[str, Any] = {}
    options_version: int = 0
    needs_newer_worker: datetime | None = None
    webhook: str | None = None
    outputs: dict[OutputName, Output] = {}
    owner: str | None = None
    project: str = DEFAULT_PROJECT
    name: str | None = None
    batch: str | None = None
    fetch_accounts: tuple[ByteAccount, ...] = ()
    context: dict[str, str] = {}
    progress: JobProgress | None = None
    error: JobError | None = None
    artifacts: dict[str, Artifact] = {}
    verdict: Verdict | None = None
    summary: JobSummary | None = None
    timings: dict[str, float] = {}

    @classmethod
    def listed_fields(cls) -> list[str]:
        """Names of the fields a list reads: the options can be longer than all others."""
        return [name for name in cls.model_fields if name not in ("options", "fetch_accounts")]

    @property
    def files(self) -> tuple[JobFile, ...]:
        """Everything that was sent or named."""
        beside = self.source_resources + self.reference_resources + self.resources
        meshes = (self.source,) if self.reference is None else (self.source, self.reference)
        return (*meshes, *beside)

    @property
    def stored_files(self) -> tuple[StoredFile, ...]:
        """Those of its files that are in the blob store."""
        return tuple(file for file in self.files if isinstance(file, StoredFile))

    @property
    def has_ended(self) -> bool:
        """Whether its state is final."""
        return self.state in FINAL_STATES

    def entry(self) -> dict[str, Any]:
        """What the step is told that enters it in the ledger."""
        return {
            "id": self.id,
            "fields": self.encoded(),
            "labels": self.labels,
            "digests": sorted({file.digest for file in self.stored_files}),
            "incomplete": len(self.stored_files) < len(self.files),
        }

    def encoded(self) -> dict[str, str]:
        """The record as the fields of a hash; absent values have no field."""
        return {
            name: str(value) if name in _PLAIN else json.dumps(value)
            for name, value in self.model_dump(mode="json").items()
            if value is not None
        }

    @classmethod
    def decoded(cls, fields: Mapping[str, str]) -> Self:
        """The record that :meth:`encoded` has written."""
        return cls.model_validate(
            {name: value if name in _PLAIN else json.loads(value) for name, value in fields.items()}
        )
