"""How a webhook proves who sends it (standardwebhooks.com): secrets and signatures."""

from __future__ import annotations

import base64
import binascii
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from standardwebhooks import Webhook

from meshcone.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from redis import Redis

    from worker.jobs.outbox import Message

SECRETS = "meshcone:webhook-secrets"
"""The hash in the broker: an API key's id and its secret."""

_PREFIX = "whsec_"
_SECRET_BYTES = range(24, 64 + 1)  # of the specification, "Signature scheme"
_SPELLING = f"a webhook secret is '{_PREFIX}' and {_SECRET_BYTES[0]} to {_SECRET_BYTES[-1]} bytes"
_HINT = f"make one with: echo {_PREFIX}$(openssl rand -base64 32)"


def require_signing_secret(secret: str) -> str:
    """Return a secret if webhooks can be signed with it; its own text is never in a message.

    Raises:
        InputError: it cannot be decoded, or is shorter or longer than the specification allows.
    """
    text = secret.removeprefix(_PREFIX)
    try:
        decoded = base64.b64decode(text + "=" * (-len(text) % 4), validate=True)
    except (binascii.Error, ValueError):
        decoded = b""
    if not secret.startswith(_PREFIX) or not decoded:
        raise InputError(f"{_SPELLING} in base64, and this one cannot be decoded; {_HINT}")
    if len(decoded) not in _SECRET_BYTES:
        raise InputError(f"{_SPELLING} in base64, and this one has {len(decoded)}; {_HINT}")
    return secret


def signed_headers(message: Message, body: bytes, secret: str) -> Mapping[str, str]:
    """The headers that carry a message's id, the time and the signature of both and the body."""
    now = datetime.now(UTC)
    return {
        "webhook-id": message.id,
        "webhook-timestamp": str(int(now.timestamp())),
        "webhook-signature": Webhook(secret).sign(message.id, now, body.decode()),
    }


class SigningSecrets:
    """The secret of each API key, kept as it is: a signature needs the secret itself.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client

    def put(self, key_id: str, secret: str) -> None:
        """Keep a key's secret.

        Raises:
            InputError: webhooks cannot be signed with it.
        """
        self._client.hset(SECRETS, key_id, require_signing_secret(secret))

    def remove(self, key_id: str) -> None:
        """Forget a key's secret: nothing more is sent in its name."""
        self._client.hdel(SECRETS, key_id)
