"""What a webhook says, and how it proves who says it (standardwebhooks.com)."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict
from standardwebhooks import Webhook

if TYPE_CHECKING:
    from collections.abc import Mapping


class Message(BaseModel):
    """A job's end, to be told.

    It says little on purpose: the receiver asks the API for the rest, with a key of its own.

    Attributes:
        id: the same however often it is sent, so that a receiver knows what it has had.
        url: where to.
        owner: the API key whose secret signs it; None for the installation's.
        at: when the job ended.
    """

    model_config = ConfigDict(frozen=True)

    id: str
    job: str
    state: str
    attempt: int
    url: str
    owner: str | None
    labels: tuple[str, ...]
    at: datetime

    def body(self) -> bytes:
        """The payload, in the form the specification recommends."""
        document = {
            "type": f"job.{self.state}",
            "timestamp": self.at.isoformat(),
            "data": {
                "id": self.job,
                "state": self.state,
                "attempt": self.attempt,
                "labels": self.labels,
                "path": f"/v1/jobs/{self.job}",
            },
        }
        return json.dumps(document, separators=(",", ":")).encode()


def signed_headers(message: Message, body: bytes, secret: str) -> Mapping[str, str]:
    """The headers that carry a message's id, the time and the signature of both and the body."""
    now = datetime.now(UTC)
    return {
        "webhook-id": message.id,
        "webhook-timestamp": str(int(now.timestamp())),
        "webhook-signature": Webhook(secret).sign(message.id, now, body.decode()),
    }
