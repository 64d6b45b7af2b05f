"""What a request handler works with."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated

from anyio import CapacityLimiter
from fastapi import Depends, Request

from service.access.quotas import JobQuotas
from service.api.checking.checks import MeshChecks
from service.api.schemas import Job
from worker.broker.connections import REPLY_TIMEOUT, connect_bytes, connect_text
from worker.jobs.batches import Batches
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobRecord
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister

if TYPE_CHECKING:
    from redis import Redis

    from service.settings import ServiceSettings


@dataclass(frozen=True)
class Context:
    """The rooms behind the front end, connected.

    Attributes:
        redis: the broker, with replies that are strings.
        quotas: what each API key may still send.
        register: which files are needed.
        checks: reads meshes in processes of their own.
        result_turns: lets one result of a batch be written at a time.
    """

    settings: ServiceSettings
    redis: Redis
    ledger: Ledger
    batches: Batches
    queue: JobQueue
    blobs: BlobStore
    quotas: JobQuotas
    register: BlobRegister
    checks: MeshChecks
    result_turns: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(1))

    def job(self, record: JobRecord) -> Job:
        """What the API says of a record."""
        return Job.of(record, self.settings.result_ttl)


@contextmanager
def open_context(settings: ServiceSettings) -> Iterator[Context]:
    """Connect; nothing is sent before it is needed, so the broker may be down.

    Raises:
        InputError: no broker is configured.
    """
    url = settings.required_redis_url()
    queue_client = connect_bytes(url)
    queue_client.connection_pool.connection_kwargs["socket_timeout"] = REPLY_TIMEOUT
    with connect_text(url) as client, queue_client, MeshChecks(settings) as checks:
        register = BlobRegister(client)
        yield Context(
            settings=settings,
            redis=client,
            ledger=Ledger(client),
            batches=Batches(client),
            queue=JobQueue(settings, queue_client),
            blobs=BlobStore.open(settings, register),
            quotas=JobQuotas(client, settings),
            register=register,
            checks=checks,
        )


def _context(request: Request) -> Context:
    context: Context = request.app.state.context
    return context


ContextDependency = Annotated[Context, Depends(_context)]
