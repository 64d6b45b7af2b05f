"""What webhooks are signed with: a secret for each API key."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from redis import Redis

SECRETS = "meshcone:webhook-secrets"


class SigningSecrets:
    """Secrets in the broker, kept as they are: a signature needs the secret itself.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client

    def put(self, key_id: str, secret: str) -> None:
        """Keep a key's secret, spelled ``whsec_`` and base64."""
        self._client.hset(SECRETS, key_id, secret)

    def remove(self, key_id: str) -> None:
        """Forget a key's secret: nothing more is sent in its name."""
        self._client.hdel(SECRETS, key_id)
