"""What the API is asked for: a job, its files and where its results are to be put."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag

from worker.jobs.records import OutputName
from worker.outbound.addresses import URL_LENGTH

LABEL_LENGTH = 200  # characters

SecretName = Annotated[
    str | None,
    Field(
        max_length=100,
        description="the name of a secret of this installation to send as the header Authorization",
    ),
]


class NamedBlob(BaseModel):
    """A file that was sent before, by ``PUT /v1/blobs/{sha256}``, and what it is to be called."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(description="file name; its suffix tells the format")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")


class LinkedFile(BaseModel):
    """A file that is somewhere else, and is fetched before its job begins."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    url: str = Field(
        pattern=r"^(https?|s3)://",
        max_length=URL_LENGTH,
        description="an https:// URL of a public address, or s3://bucket/key of a bucket that this "
        "installation fetches from",
    )
    name: str | None = Field(
        default=None,
        description="file name, whose suffix tells the format; by default the last part of the "
        "URL's path",
    )
    sha256: str | None = Field(
        default=None,
        pattern=r"^[0-9a-f]{64}$",
        description="what is found there must have this hash",
    )
    authorization: SecretName = None
    resources: Literal["relative"] | None = Field(
        default=None,
        description="`relative`: buffers and images that this glTF names are fetched from its own "
        "folder; by default only those that the request names are there",
    )


def _kind_of_name(value: Any) -> str:
    is_linked = isinstance(value, LinkedFile) or (isinstance(value, dict) and "url" in value)
    return "LinkedFile" if is_linked else "NamedBlob"


FileByName = Annotated[
    Annotated[NamedBlob, Tag("NamedBlob")] | Annotated[LinkedFile, Tag("LinkedFile")],
    Discriminator(_kind_of_name),  # so that what is wrong is said of the one that is meant
]


class OutputPlace(BaseModel):
    """Where a result is to be put."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    url: str = Field(
        pattern=r"^(https?|s3)://",
        max_length=URL_LENGTH,
        description="an https:// URL of a public address that takes a PUT, such as a presigned "
        "one, or s3://bucket/key of a bucket where this installation puts results",
    )
    authorization: SecretName = None


OutputPlaces = dict[OutputName, OutputPlace]


class JobRequest(BaseModel):
    """A job whose files were sent before or are somewhere else."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    source: FileByName = Field(description="the mesh to refine, measure or audit")
    reference: FileByName | None = Field(
        default=None,
        description="the mesh to refine it towards; only the mode audit can do without",
    )
    options: dict[str, Any] = Field(
        default_factory=dict,
        description="those that are not to be the default; see the schema Options",
    )
    source_resources: tuple[FileByName, ...] = Field(
        default=(), description="files that the source names"
    )
    reference_resources: tuple[FileByName, ...] = Field(
        default=(), description="files that the reference names"
    )
    resources: tuple[FileByName, ...] = Field(default=(), description="files that both name")
    labels: tuple[str, ...] = Field(default=(), description="names to find the job by")
    webhook: str | None = Field(default=None, description="where to say that the job has ended")
    outputs: OutputPlaces = Field(
        default_factory=dict, description="where to put what the job makes, by name"
    )
