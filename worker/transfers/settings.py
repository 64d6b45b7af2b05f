"""What an operator can set of files that are fetched, and of results that are put."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError
from pydantic_settings import NoDecode, SettingsConfigDict

from worker.settings import WorkerSettings

_HEADER_VALUE = r"^[\x21-\x7e]([\x20-\x7e]*[\x21-\x7e])?$"  # HTTP knows no blank around one


class Authorization(BaseModel):
    """What to show one server, and no other."""

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)

    host: str = Field(pattern=r"^(http://)?[a-z0-9.:\[\]-]+$")
    value: str = Field(repr=False, pattern=_HEADER_VALUE)


def _listed(value: Any) -> Any:
    if isinstance(value, str):
        return tuple(each.strip() for each in value.split(",") if each.strip())
    return value


def _prefixes(urls: tuple[str, ...]) -> tuple[str, ...]:
    for url in urls:
        if not url.startswith("s3://") or not url.removeprefix("s3://").strip("/"):
            raise PydanticCustomError("prefix", "must begin with s3:// and a bucket's name")
    return tuple(url.rstrip("/") for url in urls)


def _from_json(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    try:
        return json.loads(value)
    except ValueError:
        raise PydanticCustomError("json", "must be a JSON object") from None


Prefixes = Annotated[tuple[str, ...], NoDecode, BeforeValidator(_listed), AfterValidator(_prefixes)]


class TransferSettings(WorkerSettings):
    """Settings of whoever accepts jobs with files elsewhere, or moves these.

    They come from ``MESHCONE_*`` variables.

    Workers do without them: what solves a stranger's mesh is to hold no secret.
    """

    model_config = SettingsConfigDict(hide_input_in_errors=True)

    fetch_bytes: int = Field(
        default=512 * 1024**2,
        ge=1,
        description="size of all files together that are fetched for one job, unpacked",
    )
    max_resources: int = Field(
        default=256,
        ge=0,
        description="further files one request may bring for its meshes to name, and those that "
        "are fetched because a mesh names them",
    )
    fetch_seconds: float = Field(
        default=300, gt=0, le=3600, description="seconds one try at the files of a job may take"
    )
    fetch_attempts: int = Field(
        default=5, ge=1, le=12, description="times files are tried before their job is failed"
    )
    fetch_first_delay: float = Field(
        default=2,
        gt=0,
        le=3600,
        description="seconds before files are tried again; each pause is three times the last",
    )
    output_seconds: float = Field(
        default=120, gt=0, le=3600, description="seconds one try to put a result may take"
    )
    output_attempts: int = Field(
        default=7, ge=1, le=12, description="times a result is put before that is given up"
    )
    output_first_delay: float = Field(
        default=5,
        gt=0,
        le=3600,
        description="seconds before a result is put again; each pause is six times the last",
    )
    output_buckets: Prefixes = Field(
        default=(),
        description="where jobs may have results put in buckets, as s3://bucket or "
        "s3://bucket/prefix, with commas between; nowhere by default",
    )
    transfer_private_addresses: bool = Field(
        default=False,
        description="fetch files from, and put results to, addresses that are not public, and by "
        "http, as tests and closed networks need; whoever may submit jobs can then read what this "
        "machine reaches",
    )
    transfer_authorizations: Annotated[
        Mapping[str, Authorization], NoDecode, BeforeValidator(_from_json)
    ] = Field(
        default={},
        repr=False,
        description="secrets that a job can name for where its files are, as JSON: "
        '{"NAME": {"host": "assets.example.org", "value": "Bearer …"}}; each is sent to its host '
        "alone, by https; by http where the host is written as http://host",
    )
    fetch_buckets: Prefixes = Field(
        default=(),
        description="what jobs may have fetched from buckets, as s3://bucket or "
        "s3://bucket/prefix, with commas between; nothing by default",
    )
