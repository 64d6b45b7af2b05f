"""What an operator can set, read from ``MESHCONE_*`` environment variables.

The environment is the only source: the API, each worker and each work horse read the
same variables, so that no process can run with settings of its own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from meshcone.errors import InputError

ENVIRONMENT_PREFIX = "MESHCONE_"
LONGEST = 100 * 365 * 86_400
"""Seconds that any time which is set may be: dates beyond it could not be written."""

AbsolutePath = Annotated[Path, AfterValidator(lambda path: path.expanduser().absolute())]


class WorkerSettings(BaseSettings):
    """Settings of everything behind the HTTP front end."""

    model_config = SettingsConfigDict(
        env_prefix=ENVIRONMENT_PREFIX,
        env_ignore_empty=True,  # an empty variable is how a compose file says "not set"
        frozen=True,
    )

    redis_url: str | None = Field(
        default=None,
        pattern=r"^(redis|rediss|unix)://",
        description="broker, as redis://, rediss:// or unix://; `meshcone serve` brings its own",
    )
    data_dir: AbsolutePath = Field(
        default=Path("meshcone-data"),
        validate_default=True,
        description="holds the embedded broker's data and the blobs",
    )
    blob_url: str | None = Field(
        default=None,
        pattern=r"^[a-z0-9]+://",
        description="object store for the files, such as s3://bucket/prefix; "
        "by default the directory `blobs` in data_dir",
    )
    queue: str = Field(
        default="meshcone",
        pattern=r"^[\w-]+$",
        description="name of the one RQ queue; RQ moves jobs reliably from a single queue only",
    )
    job_timeout: int = Field(
        default=900, ge=1, le=30 * 86_400, description="seconds one attempt of a job may take"
    )
    attempts: int = Field(
        default=3,
        ge=1,
        le=3,
        description="times a job is started before its worker's death fails it",
    )
    job_memory_bytes: int = Field(
        default=10 * 1024**3,
        ge=0,
        description="memory one job may take beyond what its worker holds; 0 for no limit",
    )
    job_file_bytes: int = Field(
        default=2 * 1024**3,
        ge=0,
        description="size of any one file a job writes; 0 for no limit",
    )
    stop_grace: float = Field(
        default=30.0,
        ge=0,
        le=86_400,
        description="seconds a worker that is asked to stop gives the job in hand before it "
        "hands it back to the queue",
    )
    heartbeat_timeout: float = Field(
        default=10.0,
        ge=3,
        le=3600,
        description="seconds after which an attempt whose worker gives no sign of life is dead; "
        "workers give one every second",
    )
    reconcile_interval: float = Field(
        default=2.0,
        gt=0,
        le=3600,
        description="seconds between two comparisons of ledger and queue; what two in a row find "
        "wrong is put right",
    )
    result_ttl: int = Field(
        default=7 * 86_400,
        ge=0,
        le=LONGEST,
        description="seconds the files of a job that has ended are kept; 0 for ever",
    )
    record_ttl: int = Field(
        default=30 * 86_400,
        ge=0,
        le=LONGEST,
        description="seconds an expired job is still known as such; 0 for ever",
    )

    def required_redis_url(self) -> str:
        """The broker's URL.

        Raises:
            InputError: none is set.
        """
        if self.redis_url is None:
            raise InputError(
                "MESHCONE_REDIS_URL is not set; only `meshcone serve` brings a broker of its own"
            )
        return self.redis_url
