"""Routes: is the service up, and can it work?"""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel
from redis.exceptions import RedisError

from service.api.context import ContextDependency
from service.problems import ProblemError, broker_problem, problem

router = APIRouter(tags=["health"])


class Liveness(BaseModel):
    """The process answers."""

    status: str = "ok"


class Readiness(BaseModel):
    """The service can take a job and work on it."""

    status: str = "ok"
    workers: int


@router.get("/livez")
def livez() -> Liveness:
    """Whether the front end answers; says nothing of broker and workers."""
    return Liveness()


@router.get("/readyz")
def readyz(context: ContextDependency) -> Readiness:
    """Whether the broker answers and at least one worker is there."""
    try:
        workers = context.queue.worker_count()
    except RedisError as error:
        raise broker_problem(error, context.settings.data_dir) from None
    if workers == 0:
        raise ProblemError(problem("unavailable", "no worker is running"), {"Retry-After": "5"})
    return Readiness(workers=workers)
