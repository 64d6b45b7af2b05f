"""What a submission is: its files, wherever their bytes are, and what is asked of them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, Any

from meshcone.options import OPTIONS_VERSION, Options
from service.api.submission.parts import AnyFile, SubmittedForm, Upload
from worker.jobs.records import (
    JobFile,
    JobProgress,
    JobRecord,
    Output,
    OutputName,
    RemoteFile,
    StoredFile,
)
from worker.storage.blobs import BlobStore

if TYPE_CHECKING:
    from service.api.sender import Sender


@dataclass(frozen=True)
class IncomingFile:
    """A file of a submission, wherever its bytes are now.

    Attributes:
        file: what the job's record will say of it.
        upload: its bytes, if this request has brought them.
    """

    file: JobFile
    upload: Upload | None = None

    @property
    def size(self) -> int:
        """Bytes; none are known of what is still to be fetched."""
        return self.file.size if isinstance(self.file, StoredFile) else 0

    def identity(self) -> tuple[str | None, ...]:
        """What tells it from other files, in a request that may be repeated."""
        if isinstance(self.file, StoredFile):
            return self.file.name, self.file.digest
        return tuple(self.file.model_dump().values())

    @contextmanager
    def opened(self, blobs: BlobStore) -> Iterator[IO[bytes]]:
        """The file itself, or a copy of the blob.

        Raises:
            FileNotFoundError: it has still to be fetched.
        """
        if self.upload is not None:
            yield self.upload.file
            return
        if isinstance(self.file, RemoteFile):
            raise FileNotFoundError(self.file.name)
        with TemporaryFile() as copy:
            copy.writelines(blobs.chunks(self.file.digest))
            yield copy


@dataclass(frozen=True)
class Submission:
    """A submission whose files are known by their digests, and the id its job will have."""

    job_id: str
    source: IncomingFile
    reference: IncomingFile | None
    source_resources: tuple[IncomingFile, ...]
    reference_resources: tuple[IncomingFile, ...]
    resources: tuple[IncomingFile, ...]
    options: Options
    options_as_sent: dict[str, Any]
    labels: tuple[str, ...]
    webhook: str | None
    outputs: Mapping[OutputName, Output]

    @property
    def files(self) -> tuple[IncomingFile, ...]:
        """All of them."""
        beside = self.source_resources + self.reference_resources + self.resources
        return (*self.meshes, *beside)

    @property
    def meshes(self) -> tuple[IncomingFile, ...]:
        """The source, and the reference if there is one."""
        return (self.source,) if self.reference is None else (self.source, self.reference)

    @property
    def size(self) -> int:
        """Bytes of all files together, as far as they are known."""
        return sum(file.size for file in self.files)

    @property
    def is_complete(self) -> bool:
        """Whether none of its files has still to be fetched."""
        return not any(isinstance(each.file, RemoteFile) for each in self.files)

    def record(self, sender: Sender) -> JobRecord:
        """The job that the ledger is to know."""
        return JobRecord(
            id=self.job_id,
            created=datetime.now(UTC),
            labels=self.labels,
            source=self.source.file,
            reference=self.reference and self.reference.file,
            source_resources=tuple(each.file for each in self.source_resources),
            reference_resources=tuple(each.file for each in self.reference_resources),
            resources=tuple(each.file for each in self.resources),
            progress=None if self.is_complete else JobProgress.fetching(),
            mode=self.options.mode,
            options=self.options_as_sent,
            options_version=OPTIONS_VERSION,
            webhook=self.webhook,
            outputs=dict(self.outputs),
            owner=sender.owner,
            project=sender.project,
            context=sender.context,
        )

    def fingerprint(self) -> str:
        """A digest that is the same for the same request, and for no other."""
        document: dict[str, Any] = {
            "files": _identities((*self.meshes, *self.resources)),
            # Without defaults: a program that knows one more option makes no other request of it.
            "options": self.options.model_dump(mode="json", exclude_defaults=True),
            "labels": self.labels,
            "webhook": self.webhook,
        }
        if self.outputs:
            document["outputs"] = {name: _place(each) for name, each in self.outputs.items()}
        if self.reference is None:
            document["alone"] = True
        # Left out where empty: a key that was bound before there were sides still fits.
        if self.source_resources:
            document["source_resources"] = _identities(self.source_resources)
        if self.reference_resources:
            document["reference_resources"] = _identities(self.reference_resources)
        return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()


def gathered(
    form: SubmittedForm, job_id: str, found: Callable[[AnyFile], IncomingFile]
) -> Submission:
    """A submission whose files are what ``found`` says; what that raises is raised."""
    return Submission(
        job_id=job_id,
        source=found(form.source),
        reference=None if form.reference is None else found(form.reference),
        source_resources=tuple(map(found, form.source_resources)),
        reference_resources=tuple(map(found, form.reference_resources)),
        resources=tuple(map(found, form.resources)),
        options=form.options,
        options_as_sent=form.options_as_sent,
        labels=form.labels,
        webhook=form.webhook,
        outputs=form.outputs,
    )


def _place(output: Output) -> str | list[str]:
    # The URL alone where no secret is shown there, as a key was bound before secrets counted.
    return output.url if output.authorization is None else [output.url, output.authorization]


def _identities(files: tuple[IncomingFile, ...]) -> list[tuple[str | None, ...]]:
    return [file.identity() for file in files]
