"""Which blobs are needed, and which can be removed.

A blob is needed while a job refers to it, or somebody holds a *lease*: whoever is about to
store a blob, or to name one that is there, takes a lease first. The step of the ledger that
makes a job refer to a blob ends the job's lease. A blob that nobody needs is *doomed*, and
stays so until it is gone from the store; a lease on a doomed blob is refused, so that nobody
counts on a file that is about to vanish. Every blob was leased before it was stored, so none
is ever unknown here and the store itself is never searched.

References are counted by the ledger's steps (:mod:`worker.jobs.ledger_scripts`).
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import TYPE_CHECKING

from worker.jobs import ledger_scripts
from worker.jobs.ledger_keys import DOOMED_BLOBS

if TYPE_CHECKING:
    from redis import Redis

    from worker.storage.blobs import BlobStore

LEASE_SECONDS = 3600
"""Far longer than from storing a file to the step that refers to it."""

_PATIENCE = 5.0  # seconds to wait for a removal that is under way
_EXAMINED_AT_ONCE = 1000
_REMOVED_AT_ONCE = 20
_REMOVAL_SECONDS = 60  # to remove those, after which another may try


class BlobBusyError(Exception):
    """The blob is being removed; a moment later it can be stored again."""


class BlobRegister:
    """Leases on blobs, and the blobs nobody needs.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client
        self._lease = client.register_script(ledger_scripts.LEASE)
        self._end_leases = client.register_script(ledger_scripts.END_LEASES)
        self._take = client.register_script(ledger_scripts.TAKE_DOOMED)

    def lease(self, digests: Iterable[str], holder: str, seconds: int = LEASE_SECONDS) -> None:
        """Keep blobs, there already or soon to be, for a time.

        Args:
            digests: the blobs.
            holder: for whom: the id of the job that will refer to them, or another name.
            seconds: how long at least; taken again, a lease is only ever made longer.

        Raises:
            BlobBusyError: one is being removed, and was not gone within five seconds.
        """
        arguments: list[str | int] = [seconds, holder, *digests]
        deadline = time.monotonic() + _PATIENCE
        while self._lease([], arguments):
            if time.monotonic() > deadline:
                raise BlobBusyError
            time.sleep(0.05)

    def sweep(self, blobs: BlobStore) -> int:
        """Remove the blobs nobody needs, and return how many they were. Repeatable.

        It can be interrupted anywhere, and two can be under way at once.
        """
        while self._end_leases([], [_EXAMINED_AT_ONCE]) == _EXAMINED_AT_ONCE:
            pass
        removed = 0
        while taken := self._take([], [_REMOVED_AT_ONCE, _REMOVAL_SECONDS]):
            # One that was taken too long ago may be another's by now, and even leased again.
            deadline = time.monotonic() + _REMOVAL_SECONDS / 2
            for digest in taken:
                if time.monotonic() > deadline:
                    break
                blobs.delete(digest)
                self._client.zrem(DOOMED_BLOBS, digest)
                removed += 1
        return removed
