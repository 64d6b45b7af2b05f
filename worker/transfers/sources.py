"""The files of a job, fetched from where they are into the blob store."""

from __future__ import annotations

import asyncio
import os
import tempfile
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING

from meshcone.errors import InputError, LimitError, MeshConeError
from worker.jobs.fetch_accounts import FetchAccounts
from worker.jobs.records import JobFile, JobRecord, RemoteFile, StoredFile
from worker.storage.blobs import BlobStore, digest_of
from worker.transfers.buckets import Buckets
from worker.transfers.budget import Budget
from worker.transfers.places import host_of, is_in_bucket, secret_for
from worker.transfers.relative import beside, names_in
from worker.transfers.web import Web

if TYPE_CHECKING:
    from worker.storage.register import BlobRegister
    from worker.transfers.settings import TransferSettings


class Sources:
    """Fetches and stores the files of one job after another.

    Args:
        settings: how much, and where from.
        blobs: where the files go.
        register: keeps them from vanishing before the ledger knows them.
        accounts: counts their bytes.
    """

    def __init__(
        self,
        settings: TransferSettings,
        blobs: BlobStore,
        register: BlobRegister,
        accounts: FetchAccounts,
    ) -> None:
        self._settings = settings
        self._blobs = blobs
        self._register = register
        self._accounts = accounts
        self._web = Web(private_addresses=settings.transfer_private_addresses)
        self._buckets = Buckets(settings.fetch_buckets)

    async def close(self) -> None:
        """End every connection."""
        await self._web.close()

    async def complete(self, record: JobRecord) -> JobRecord:
        """The record with all of its files in the store.

        All of them are fetched in one go: parts of two versions of an asset fit nobody.

        Raises:
            InputError: a server, or what it says, cannot be used. A
                :class:`~worker.transfers.errors.PassingError` if that may change by itself.
            LimitError: there is more than this installation fetches for one job, or more than
                its sender may have fetched.
            StoreError: the blob store cannot be used.
            OSError: the disk where files are kept as they come cannot be used.
        """
        await asyncio.to_thread(self._accounts.give_back, record.id)  # of a try that was cut off
        errand = _Errand(
            self,
            record,
            Budget(self._settings.fetch_bytes),
            self._settings.max_resources - _resources_of(record),
        )
        resources = await errand.all(record.resources)
        source, of_source = await errand.side(record.source, record.source_resources, resources)
        reference, of_reference = None, record.reference_resources
        if record.reference is not None:
            reference, of_reference = await errand.side(
                record.reference, record.reference_resources, resources
            )
        return record.model_copy(
            update={
                "source": source,
                "reference": reference,
                "source_resources": of_source,
                "reference_resources": of_reference,
                "resources": resources,
            }
        )

    async def download(self, file: RemoteFile, into: IO[bytes], budget: Budget) -> None:
        """Write what is at a file's URL into an open file; raises as :meth:`complete` does."""
        if is_in_bucket(file.url):
            await self._buckets.fetch(file.url, into, budget)
            return
        secret = None
        if file.authorization is not None:
            secret = secret_for(file.url, file.authorization, self._settings)
        await self._web.fetch(file.url, into, budget, secret)

    def keep(self, file: RemoteFile, content: IO[bytes], record: JobRecord) -> StoredFile:
        """Store what was fetched, for a job that will refer to it.

        How long that takes tells nobody whether another project has the same file.

        Raises:
            InputError: it is not what the sender said it would be.
            LimitError: its sender may have no more bytes fetched today.
        """
        digest = digest_of(content)
        if file.sha256 not in (None, digest):
            raise InputError(
                f"{host_of(file.url)} has other bytes than expected: their SHA-256 is {digest}, "
                f"not {file.sha256}"
            )
        is_new = not self._register.is_had(digest, record.project)
        size = content.seek(0, os.SEEK_END)
        self._accounts.take(record.id, record.fetch_accounts, size)
        self._register.lease([digest], record.id)
        self._blobs.put_file(content, digest, anew=is_new)
        return StoredFile(name=file.name, digest=digest, size=size, origin=file.origin)


def _resources_of(record: JobRecord) -> int:
    return len(record.source_resources + record.reference_resources + record.resources)


@dataclass
class _Errand:
    """One try at the files of one job.

    Attributes:
        record: the job.
        budget: the bytes that it may still fetch.
        names_left: the files, beside those it was sent with, that its meshes may still name.
    """

    sources: Sources
    record: JobRecord
    budget: Budget
    names_left: int

    async def all(self, files: tuple[JobFile, ...]) -> tuple[StoredFile, ...]:
        return tuple([await self.stored(file) for file in files])

    async def side(
        self, mesh: JobFile, beside_it: tuple[JobFile, ...], of_both: tuple[StoredFile, ...]
    ) -> tuple[StoredFile, tuple[StoredFile, ...]]:
        """A mesh and its own resources, those that it names among them if that is asked for."""
        own = await self.all(beside_it)
        if isinstance(mesh, StoredFile):
            return mesh, own
        stored, names = await self._fetched(mesh)
        sent = {file.name for file in (*own, *of_both)}
        named = [
            RemoteFile(name=name, url=beside(mesh.url, name), authorization=mesh.authorization)
            for name in names
            if name not in sent
        ]
        self._count(named, mesh.name)
        return stored, (*own, *await self.all(tuple(named)))

    def _count(self, named: list[RemoteFile], mesh: str) -> None:
        if len(named) > self.names_left:
            raise LimitError(
                f"the glTF names {len(named)} more files, and the job may have "
                f"{max(self.names_left, 0)} more (MESHCONE_MAX_RESOURCES)",
                file=mesh,
            )
        self.names_left -= len(named)

    async def stored(self, file: JobFile) -> StoredFile:
        return file if isinstance(file, StoredFile) else (await self._fetched(file))[0]

    async def _fetched(self, file: RemoteFile) -> tuple[StoredFile, list[str]]:
        """A file, and the names in it that are to be fetched too."""
        try:
            with tempfile.TemporaryFile() as content:
                await self.sources.download(file, content, self.budget)
                stored = await asyncio.to_thread(self.sources.keep, file, content, self.record)
                if file.resources is None:
                    return stored, []
                return stored, await asyncio.to_thread(names_in, content)
        except MeshConeError as error:
            error.file = file.name
            raise
