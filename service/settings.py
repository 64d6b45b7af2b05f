"""What an operator can set of the HTTP front end, beside what it shares with the workers."""

from __future__ import annotations

from typing import Annotated, Literal
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field

from worker.settings import LONGEST
from worker.transfers.settings import TransferSettings
from worker.webhooks.settings import WebhookSettings

MEBIBYTE = 1024 * 1024


def _origins(text: str) -> str:
    for origin in text.split(","):
        url = urlsplit(origin)
        is_origin = url.scheme in ("http", "https") and f"{url.scheme}://{url.netloc}" == origin
        if origin != "*" and not (is_origin and url.hostname):
            raise ValueError(f"'{origin}' is not an origin, such as https://assets.example.org")
    return text


class ServiceSettings(WebhookSettings, TransferSettings):
    """Settings of the HTTP front end, from ``MESHCONE_*`` environment variables."""

    max_upload_bytes: int = Field(
        default=512 * MEBIBYTE,
        ge=1,
        description="size of a whole request, both meshes and all their files",
    )
    precheck_bytes: int = Field(
        default=16 * MEBIBYTE,
        ge=0,
        description="requests with no more bytes of files than this are read before they are "
        "accepted, so that a bad file is refused at once; a worker judges the larger ones",
    )
    precheck_memory_bytes: int = Field(
        default=1024 * MEBIBYTE,
        ge=64 * MEBIBYTE,
        description="memory that reading the files of one request may take, in a process of its "
        "own; there are at most two at one time",
    )
    precheck_seconds: int = Field(
        default=30,
        ge=1,
        description="seconds of processor time that reading the files of one request may take",
    )
    queue_capacity: int = Field(
        default=20_000,
        ge=1,
        description="jobs that may be queued, those of batches among them; as long as they are, "
        "further ones get a 503",
    )
    batch_pairs: int = Field(
        default=10_000, ge=1, le=100_000, description="pairs that one batch may have"
    )
    batch_bytes: int = Field(
        default=64 * MEBIBYTE, ge=1, description="size of a batch's JSON, on disk as it comes"
    )
    upload_ttl: int = Field(
        default=86_400,
        ge=1,
        le=LONGEST,
        description="seconds a file sent by PUT /v1/blobs is kept while no job names it",
    )
    event_streams: int = Field(
        default=500,
        ge=0,
        description="clients that may follow a job's events or wait for its end at one time, "
        "of each API process",
    )
    max_connections: int = Field(
        default=2000,
        ge=1,
        description="connections of each API process; streams count among them, and fewer are "
        "held where too few files may be open",
    )
    header_timeout: float = Field(
        default=10.0,
        gt=0,
        le=3600,
        description="seconds in which the header of a request has to come",
    )
    body_timeout: float = Field(
        default=30.0,
        gt=0,
        le=3600,
        description="seconds for which the body of a request may come more slowly than body_rate",
    )
    body_rate: int = Field(
        default=4096, ge=1, description="bytes a second in which the body of a request has to come"
    )
    retry_after: int = Field(
        default=1, ge=1, description="seconds a client is asked to wait before it looks again"
    )
    cors_origins: Annotated[str, AfterValidator(_origins)] | None = Field(
        default=None,
        max_length=4096,
        description="origins whose pages may use this service, such as "
        "https://assets.example.org, separated by commas; `*` is any, of a server that asks for "
        "keys; by default none",
    )
    require_keys: Literal["auto", "always"] = Field(
        default="auto",
        description="`auto` asks for API keys unless the address listened on is a loopback one; "
        "`always` asks for them there too, as behind a proxy",
    )
    key_requests_per_minute: int = Field(
        default=600, ge=0, description="requests a minute of one API key; 0 for any number"
    )
    key_active_jobs: int = Field(
        default=20_000,
        ge=0,
        description="jobs of one API key that may be queued or running; 0 for any number",
    )
    key_daily_bytes: int = Field(
        default=0,
        ge=0,
        description="bytes of files one API key may send or have fetched a day; 0 for any number",
    )
    project_active_jobs: int = Field(
        default=0,
        ge=0,
        description="jobs of all keys of a project that may be queued or running; 0 for any number",
    )
    project_daily_bytes: int = Field(
        default=0,
        ge=0,
        description="bytes of files all keys of a project may send or have fetched a day; 0 for "
        "any number",
    )

    @property
    def origins(self) -> tuple[str, ...]:
        """The origins whose pages may use this service."""
        return () if self.cors_origins is None else tuple(self.cors_origins.split(","))
