"""What an operator can set of webhooks."""

from __future__ import annotations

from pydantic import Field

from worker.settings import WorkerSettings


class WebhookSettings(WorkerSettings):
    """Settings of whoever accepts or delivers webhooks, from ``MESHCONE_*`` variables.

    Workers do without them: what solves a stranger's mesh is to hold no secret.
    """

    webhook_secret: str | None = Field(
        default=None,
        pattern=r"^whsec_[A-Za-z0-9+/]{32,}={0,2}$",
        repr=False,
        description="signs the webhooks of jobs that were sent without an API key, as `whsec_` and "
        "base64; without it such jobs cannot have one",
    )
    webhook_attempts: int = Field(
        default=7, ge=1, le=12, description="times a webhook is sent before it is given up"
    )
    webhook_first_delay: float = Field(
        default=5,
        gt=0,
        le=3600,
        description="seconds before a webhook is sent again; each pause is six times the last",
    )
    webhook_timeout: float = Field(
        default=20, gt=0, le=120, description="seconds a receiver may take to answer"
    )
    webhook_private_addresses: bool = Field(
        default=False,
        description="send webhooks to addresses that are not public, as tests and closed networks "
        "need; whoever may submit jobs can then reach what this machine reaches",
    )
