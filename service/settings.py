"""What an operator can set of the HTTP front end, beside what it shares with the workers."""

from __future__ import annotations

from pydantic import Field

from worker.settings import WorkerSettings

MEBIBYTE = 1024 * 1024


class ServiceSettings(WorkerSettings):
    """Settings of the HTTP front end, from ``MESHCONE_*`` environment variables."""

    max_upload_bytes: int = Field(
        default=256 * MEBIBYTE, ge=1, description="size of a whole request, files and all"
    )
    max_resources: int = Field(
        default=64, ge=0, description="further files one request may bring for its meshes to name"
    )
    precheck_bytes: int = Field(
        default=16 * MEBIBYTE,
        ge=0,
        description="requests with no more bytes of files than this are read before they are "
        "accepted, so that a bad file is refused at once; a worker judges the larger ones",
    )
    retry_after: int = Field(
        default=1, ge=1, description="seconds a client is asked to wait before it looks again"
    )
