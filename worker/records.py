"""What the ledger remembers of a job."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from meshcone.errors import ErrorKind, MeshConeError
from meshcone.progress import Progress, Stage

JobState = Literal["queued", "running", "succeeded", "failed", "canceled"]


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True)


class StoredFile(_Frozen):
    """A sent file: its name, and the digest under which the blob store holds it."""

    name: str
    digest: str
    size: int


class Artifact(_Frozen):
    """A file a job made."""

    digest: str
    media_type: str
    filename: str
    size: int


class JobProgress(_Frozen):
    """How far a running job has come; see :class:`meshcone.progress.Progress`."""

    stage: Stage
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


class JobRecord(_Frozen):
    """One job.

    Attributes:
        attempt: how often it has been started.
        options: every option with its resolved value.
        artifacts: what it made, by name: ``report`` and, of a refinement, ``mesh``,
            ``diagnostics_csv`` and, unless the input was kept, ``certificate``.
    """

    id: str
    state: JobState = "queued"
    attempt: int = 0
    created: datetime
    started: datetime | None = None
    finished: datetime | None = None
    label: str | None = None
    source: StoredFile
    reference: StoredFile
    resources: tuple[StoredFile, ...] = ()
    options: dict[str, Any]
    progress: JobProgress | None = None
    error: JobError | None = None
    artifacts: dict[str, Artifact] = {}
