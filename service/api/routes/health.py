"""Routes: is the service up, and can it work?"""

from __future__ import annotations

from tempfile import TemporaryFile
from typing import Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field
from redis.exceptions import RedisError

from service.api.context import ContextDependency
from service.problems import MEDIA_TYPE, ProblemError, broker_problem, problem
from service.settings import ServiceSettings
from worker.disk import has_room
from worker.storage.local import ROOM_LEFT
from worker.storage.places import store_directory

router = APIRouter(tags=["health"])

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
def livez() -> Liveness:
    """Whether the front end answers; says nothing of broker and workers."""
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
    reason = _store_trouble(context.settings)
    if reason is None and workers == 0:
        reason = "no worker is running"
    if reason is not None:
        raise ProblemError(problem("unavailable", reason), {"Retry-After": "5"})
    if suspended:
        words = "the workers are suspended: jobs wait until `rq resume` is run"
        return Readiness(status="degraded", workers=workers, reason=words)
    if waiting >= context.settings.queue_capacity:
        words = f"{waiting} jobs wait, as many as may (MESHCONE_QUEUE_CAPACITY)"
        return Readiness(status="degraded", workers=workers, reason=words)
    return Readiness(workers=workers)


def _store_trouble(settings: ServiceSettings) -> str | None:
    """Why the directory of files takes no writes; None if it does, or files are in a bucket."""
    directory = store_directory(settings)
    if directory is None:
        return None
    try:
        if not has_room(directory, ROOM_LEFT):
            return "the disk of the data directory is full; work goes on when it has room"
        with TemporaryFile(dir=directory, buffering=0) as probe:
            probe.write(b"ready")
    except OSError as error:
        return f"the file store in the data directory cannot be written: {error.strerror}"
    return None
