"""API keys: who may do what.

A key is shown once, when it is made; the broker keeps its SHA-256 digest. A slow hash
protects passwords, which can be guessed; a key is 256 random bits, which cannot.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import re
import secrets
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field

from meshcone.errors import InputError
from meshcone.text import is_line
from worker.jobs.identifiers import DEFAULT_PROJECT, is_project
from worker.webhooks.signing import SigningSecrets

if TYPE_CHECKING:
    from redis import Redis

Scope = Literal["submit", "read", "delete", "admin"]
SCOPES: tuple[Scope, ...] = get_args(Scope)

KEYS = "meshcone:keys"
"""The hash in the broker: a key's id and, as JSON, what is known of it."""

_TOKEN = re.compile(r"mc_([0-9a-f]{16})_([\w-]{43})")
_NAME_LENGTH = 100  # characters


class Quota(BaseModel):
    """What a key may use; None stands for what the installation allows, 0 for no limit."""

    model_config = ConfigDict(frozen=True)

    requests_per_minute: int | None = Field(default=None, ge=0)
    active_jobs: int | None = Field(default=None, ge=0)
    daily_bytes: int | None = Field(default=None, ge=0)


class ApiKey(BaseModel):
    """A key, as far as the broker knows it.

    Attributes:
        id: its public part, which names it in logs and records.
        digest: SHA-256 of its secret part, in hexadecimal digits.
        project: whose jobs and files it may see, and whose those are that it sends.
    """

    model_config = ConfigDict(frozen=True)

    id: str
    name: str
    scopes: tuple[Scope, ...]
    created: datetime
    digest: str
    project: str = DEFAULT_PROJECT
    quota: Quota = Quota()

    @property
    def view(self) -> str | None:
        """The project whose jobs and files it may see; None where it may see all."""
        return None if "admin" in self.scopes else self.project

    def allows(self, scope: Scope) -> bool:
        """Whether it has a scope; ``admin`` has them all."""
        return scope in self.scopes or "admin" in self.scopes

    def has_secret(self, secret: str) -> bool:
        """Whether this is its secret part, in time that does not tell how much of it is."""
        return hmac.compare_digest(self.digest, _digest(secret))


@dataclass(frozen=True)
class NewKey:
    """A key just made, with what is not shown again.

    Attributes:
        token: what a client sends.
        webhook_secret: what its webhooks are signed with.
    """

    key: ApiKey
    token: str
    webhook_secret: str


def parse_token(token: str) -> tuple[str, str] | None:
    """The id and the secret part of a token, or None if it is not spelled as one."""
    match = _TOKEN.fullmatch(token)
    return (match[1], match[2]) if match else None


class KeyStore:
    """The keys of an installation.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client
        self._secrets = SigningSecrets(client)

    def create(
        self,
        name: str,
        scopes: Iterable[Scope],
        quota: Quota | None = None,
        project: str = DEFAULT_PROJECT,
    ) -> NewKey:
        """Make a key.

        Raises:
            InputError: its name is empty, too long or no single line, or no project can be
                called so.
        """
        if not is_project(project):
            raise InputError(
                f"a project's name has 1 to 63 characters of a-z, 0-9 and -, and neither begins "
                f"nor ends with -; found '{project}'"
            )
        if not name or len(name) > _NAME_LENGTH or not is_line(name):
            raise InputError(f"a key's name is one line of 1 to {_NAME_LENGTH} characters")
        key_id, secret = secrets.token_hex(8), secrets.token_urlsafe(32)
        key = ApiKey(
            id=key_id,
            name=name,
            scopes=tuple(scope for scope in SCOPES if scope in set(scopes)),
            created=datetime.now(UTC),
            digest=_digest(secret),
            project=project,
            quota=quota or Quota(),
        )
        webhook_secret = "whsec_" + base64.b64encode(secrets.token_bytes(32)).decode()
        # The secret first: a key that works has all that belongs to it.
        self._secrets.put(key_id, webhook_secret)
        self._client.hset(KEYS, key_id, key.model_dump_json())
        return NewKey(key, f"mc_{key_id}_{secret}", webhook_secret)

    def all(self) -> list[ApiKey]:
        """Every key, oldest first."""
        stored = self._client.hvals(KEYS)
        return sorted(map(ApiKey.model_validate_json, stored), key=lambda key: key.created)

    def revoke(self, key_id: str) -> None:
        """Forget a key; requests with it are refused from now on.

        Raises:
            InputError: there is none of that id.
        """
        if not self._client.hdel(KEYS, key_id):
            raise InputError(
                f"there is no key '{key_id}'; `meshcone keys list` shows the keys that exist"
            )
        self._secrets.remove(key_id)


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()
