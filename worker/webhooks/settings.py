"""What an operator can set of webhooks."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from meshcone.errors import InputError
from worker.settings import WorkerSettings
from worker.webhooks.signing import require_signing_secret


def _signing_secret(secret: str) -> str:
    try:
        return require_signing_secret(secret)
    except InputError as error:
        raise PydanticCustomError("webhook_secret", "{reason}", {"reason": error.message}) from None


class WebhookSettings(WorkerSettings):
    """Settings of whoever accepts or delivers webhooks, from ``MESHCONE_*`` variables.

    Workers do without them: what solves a stranger's mesh is to hold no secret.
    """

    webhook_secret: Annotated[str, AfterValidator(_signing_secret)] | None = Field(
        default=None,
        repr=False,
        description="signs the webhooks of jobs that were sent without an API key, as `whsec_` and "
        "24 to 64 bytes in base64; without it such jobs cannot have one",
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
