"""Routes: is the service up, and can it work?"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, Field
from redis.exceptions import RedisError

from service.api.context import ContextDependency
from service.api.routing import HeadRouter
from service.problems import MEDIA_TYPE, ProblemError, broker_problem, problem
from worker.storage.blobs import BlobStore
from worker.storage.errors import StoreError

router = HeadRouter(tags=["health"])

_PROBE = "meshcone:ready"  # written at each look: a broker can answer and yet take no writes
_PROBE_KEPT = 60_000  # milliseconds
_UNAVAILABLE: dict[str, Any] = {
    "description": "no job can be worked on; `detail` says why",
    "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}},
}


class Liveness(BaseModel):
    """The process answers."""

    status: str = "ok"


class Readiness(BaseModel):
    """The service can take a job and work on it, or can soon."""

    status: Literal["ok", "degraded"] = Field(
        default="ok",
        description="degraded: it answers, but refuses new jobs or lets them wait for now",
    )
    workers: int
    reason: str | None = Field(default=None, description="why it is degraded")


@router.get("/livez")
async def livez() -> Liveness:
    """Whether the front end answers; says nothing of broker and workers."""
    # It waits for no thread: one that is busy is alive.
    return Liveness()


@router.get("/readyz", responses={503: _UNAVAILABLE})
def readyz(context: ContextDependency) -> Readiness:
    """Whether broker and file store take writes, and a worker is there.

    A queue at its bound is no failure: all else works, and it empties by itself. Suspended
    workers are none either: jobs are accepted, and wait.
    """
    try:
        context.redis.set(_PROBE, "1", px=_PROBE_KEPT)
        workers = context.queue.worker_count()
        suspended = context.queue.is_suspended()
        waiting = context.ledger.index.count("queued")
    except RedisError as error:
        raise broker_problem(error, context.settings.data_dir) from None
    reason = _store_trouble(context.blobs)
    if reason is None and workers == 0:
        reason = "no worker is running"
    if reason is not None:
        raise ProblemError(problem("unavailable", reason), {"Retry-After": "5"})
    if suspended:
        words = "the workers are suspended: jobs wait until `rq resume` is run"
        return Readiness(status="degraded", workers=workers, reason=words)
    if waiting >= context.settings.queue_capacity:
        words = f"the queue is full: {waiting} jobs wait (MESHCONE_QUEUE_CAPACITY)"
        return Readiness(status="degraded", workers=workers, reason=words)
    return Readiness(workers=workers)


def _store_trouble(blobs: BlobStore) -> str | None:
    """Why the file store takes no writes; None if it does."""
    try:
        blobs.require_writable()
    except FileNotFoundError:
        return "the directory or bucket of the file store is not there"
    except StoreError as error:
        return str(error)
    return None
