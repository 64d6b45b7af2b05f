"""Requests that may be repeated: a key of the sender's names what a request has made.

After the Internet draft *The Idempotency-Key HTTP Header Field* (httpapi working group). A
key is claimed while its first request is under way; the ledger binds it to the job in the
step that creates the job, so there is no moment at which one exists without the other.
"""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from redis import Redis

CLAIM_SECONDS = 10
"""How long a claim outlives a process that was killed: less than the time in which an
installation has recovered, or its clients would still be told to wait. One that is lost
earlier loses the answer 409 to a second request under way, never the promise of one job."""

_CLAIM = f"""
local job, fingerprint = unpack(redis.call('HMGET', KEYS[1], 'job', 'fingerprint'))
if job then return {{1, job, fingerprint}} end
-- One that outlives every claim was made before the broker's clock was set back.
local left = redis.call('PTTL', KEYS[1])
if redis.call('EXISTS', KEYS[1]) == 1 and left <= {1000 * CLAIM_SECONDS} then return {{0}} end
redis.call('HSET', KEYS[1], 'claim', ARGV[1])
redis.call('EXPIRE', KEYS[1], {CLAIM_SECONDS})
return {{1}}
"""
_PROLONG = f"""
if redis.call('HGET', KEYS[1], 'claim') == ARGV[1] and redis.call('HEXISTS', KEYS[1], 'job') == 0
then redis.call('EXPIRE', KEYS[1], {CLAIM_SECONDS}) end
"""
_RELEASE = """
if redis.call('HGET', KEYS[1], 'claim') == ARGV[1] and redis.call('HEXISTS', KEYS[1], 'job') == 0
then redis.call('DEL', KEYS[1]) end
"""


@dataclass(frozen=True)
class BoundKey:
    """A key and what was sent with it.

    Attributes:
        place: where the broker keeps it.
        fingerprint: equal for equal requests.
        remembered: seconds after which the key may be used for something else.
    """

    place: str
    fingerprint: str
    remembered: int


@dataclass(frozen=True)
class Claim:
    """A key that a request has come with.

    Attributes:
        place: where the broker keeps it.
        token: proves whose claim it is.
        job_id: the job it has made before, if it has.
        fingerprint: of the request that made that job.
    """

    place: str
    token: str
    job_id: str | None = None
    fingerprint: str | None = None


class KeyInUseError(Exception):
    """A request with the same key is under way."""


class KeyClaims:
    """Keys of requests that are under way.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._claim = client.register_script(_CLAIM)
        self._prolong = client.register_script(_PROLONG)
        self._release = client.register_script(_RELEASE)

    def claim(self, place: str) -> Claim:
        """Claim a key for a request; a key that has made its job cannot be claimed again.

        Raises:
            KeyInUseError: another request has claimed it.
        """
        token = secrets.token_hex(16)
        free, *known = self._claim([place], [token])
        if not free:
            raise KeyInUseError
        return Claim(place, token, *known)

    def prolong(self, claim: Claim) -> None:
        """Keep a claim for as long again, unless its request has made its job by now."""
        self._prolong([claim.place], [claim.token])

    def release(self, claim: Claim) -> None:
        """Give up a claim, if its request made no job."""
        self._release([claim.place], [claim.token])


def key_place(owner: str, key: str) -> str:
    """Where a sender's key is kept; the same key of two senders is two keys."""
    digest = hashlib.sha256(f"{len(owner)}:{owner}:{key}".encode()).hexdigest()
    return f"meshcone:idempotency:{digest}"
