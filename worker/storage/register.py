"""Which blobs are needed, under which names, and which can be removed.

A blob is needed while a job refers to it, or somebody holds a *lease*: whoever is about to
store a blob, or to name one that is there, takes a lease first. The step of the ledger that
makes a job refer to a blob ends the job's lease.

A blob that becomes needed gets a *generation*, and is stored under its digest and that. When
nobody needs it any more, its generation is forgotten and its name is *doomed*: to be removed,
and never used again. The same content, needed once more, gets another generation. So the
removal of a name harms nobody, however late it reaches the store.

Every blob was leased before it was stored, so none is ever unknown here and the store itself
is never searched. Blobs of earlier versions are stored under their digest alone; they are
needed, and have no generation.

References are counted by the ledger's steps (:mod:`worker.jobs.blob_scripts`).
"""

from __future__ import annotations

import secrets
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from worker.jobs import blob_scripts
from worker.jobs.identifiers import DEFAULT_PROJECT
from worker.jobs.ledger_keys import BLOB_LEASES, DOOMED_BLOBS, blobs_of

if TYPE_CHECKING:
    from redis import Redis

LEASE_SECONDS = 3600
"""Far longer than from storing a file to the step that refers to it."""

DAMAGED_SECONDS = 7 * 86_400
"""How long a damaged file stays where it is, to be looked at."""

_EXAMINED_AT_ONCE = 1000
_REMOVED_AT_ONCE = 20
_REMOVAL_SECONDS = 60  # to remove those, after which another tries too


class BlobRegister:
    """Leases on blobs, their names, and the names that nothing needs.

    Args:
        client: a connection whose replies are strings.
        when_full: whether leases are taken at the broker's memory limit too. They are for
            results: their job is begun, and with its end its memory can be freed.
    """

    def __init__(self, client: Redis, *, when_full: bool = False) -> None:
        self._client = client
        lease = blob_scripts.LEASE_WHEN_FULL if when_full else blob_scripts.LEASE
        self._lease = client.register_script(lease)
        self._end_leases = client.register_script(blob_scripts.END_LEASES)
        self._take = client.register_script(blob_scripts.TAKE_DOOMED)
        self._names = client.register_script(blob_scripts.NAMES_OF)
        self._set_aside = client.register_script(blob_scripts.SET_ASIDE)
        self._is_had = client.register_script(blob_scripts.IS_HAD)

    def lease(self, digests: Iterable[str], holder: str, seconds: int = LEASE_SECONDS) -> None:
        """Keep blobs, there already or soon to be, for a time.

        Args:
            digests: the blobs.
            holder: for whom: the id of the job that will refer to them, or another name.
            seconds: how long at least; taken again, a lease is only ever made longer.
        """
        self._lease([], [seconds, holder, _generation(), *digests])

    def lease_upload(self, digest: str, project: str, seconds: int) -> None:
        """Keep a file that a project has sent, for a time in which its jobs can name it."""
        self.lease([digest], _uploads_of(project), seconds)

    def prolong_upload(self, digest: str, project: str, seconds: int) -> None:
        """Keep such a file for a time from now on, if it is kept as one still.

        A file that only jobs hold is not made one: it is to go with the last of them.
        """
        until = float(self._client.time()[0]) + seconds
        lease = f"{digest}/{_uploads_of(project)}"
        self._client.zadd(BLOB_LEASES, {lease: until}, xx=True, gt=True)

    def is_had(self, digest: str, project: str | None) -> bool:
        """Whether a project has a file: it has sent it, or jobs of it have it.

        A file that others have takes as long to tell as one that nobody has.

        Args:
            digest: the file.
            project: None for all projects together, which have every file.
        """
        if project is None:
            return True
        return bool(self._is_had([blobs_of(project)], [digest, _uploads_of(project)]))

    def names_of(self, digests: Sequence[str]) -> list[str | None]:
        """Names of blobs in the store, present or to come; None for one that nothing needs."""
        return [name or None for name in self._names([], digests)]

    def set_aside(self, digest: str, name: str) -> bool:
        """Have a blob that is damaged stored under another name from now on.

        The damaged one can be looked at for a while, and is then removed.

        Returns:
            Whether it had this name still.
        """
        return bool(self._set_aside([], [digest, name, _generation(), DAMAGED_SECONDS]))

    def end_leases(self) -> None:
        """End the leases that have run out, but for those of batches that are being entered."""
        step = [_EXAMINED_AT_ONCE, LEASE_SECONDS]
        while self._end_leases([], step) == _EXAMINED_AT_ONCE:
            pass

    def take_doomed(self) -> list[str]:
        """Names to be removed, a few at once; nobody else is given them for a minute."""
        return [str(name) for name in self._take([], [_REMOVED_AT_ONCE, _REMOVAL_SECONDS])]

    def forget(self, name: str) -> None:
        """Note that a name is removed."""
        self._client.zrem(DOOMED_BLOBS, name)


def _uploads_of(project: str) -> str:
    # What was sent before there were projects belongs to the default one.
    return "upload" if project == DEFAULT_PROJECT else f"upload/{project}"


def _generation() -> str:
    return secrets.token_hex(8)
