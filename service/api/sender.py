"""Who sends a request, and under what name it is followed."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Annotated

import structlog
from fastapi import Depends, Header, Request
from redis.exceptions import RedisError
from starlette.concurrency import run_in_threadpool

from service.access.keys import ApiKey
from service.api.context import ContextDependency
from service.api.routing import Absent
from service.problems import ProblemError, problem, queue_full
from worker.jobs.idempotency import CLAIM_SECONDS, Claim, KeyClaims, KeyInUseError, key_place
from worker.jobs.identifiers import DEFAULT_PROJECT
from worker.run.tracing import current_context

_KEY_LENGTH = 255  # characters


@dataclass(frozen=True)
class Sender:
    """Who sends a request.

    Attributes:
        key: the API key it came with, if it did.
        context: what its log lines and its trace begin with.
    """

    key: ApiKey | None
    context: dict[str, str]

    @property
    def owner(self) -> str | None:
        """The key's id."""
        return None if self.key is None else self.key.id

    @property
    def project(self) -> str:
        """Whose what it sends is."""
        return DEFAULT_PROJECT if self.key is None else self.key.project

    @property
    def view(self) -> str | None:
        """The project whose jobs and files it may see; None where it may see all."""
        return None if self.key is None else self.key.view


def _sender(request: Request) -> Sender:
    bound = structlog.contextvars.get_contextvars()
    names = {name: str(bound[name]) for name in ("request_id",) if name in bound}
    return Sender(getattr(request.state, "key", None), {**names, **current_context()})


SenderDependency = Annotated[Sender, Depends(_sender)]


async def _claim(
    context: ContextDependency,
    sender: SenderDependency,
    idempotency_key: Annotated[
        str | Absent,
        Header(
            min_length=1,
            max_length=_KEY_LENGTH,
            pattern=r"^[\x20-\x7e]+$",
            description="chosen by the client; requests with the same key and the same content "
            "make one job, for a day",
        ),
    ] = None,
) -> AsyncIterator[Claim | None]:
    """Let a request in before its body is read, and claim its Idempotency-Key while it lasts.

    Raises:
        ProblemError: the queue is full, or a request with the same key is under way.
    """
    if idempotency_key is None:
        await run_in_threadpool(_require_room, context, sender)
        yield None
        return
    claims = KeyClaims(context.redis)
    try:
        place = key_place(sender.owner or "", idempotency_key)
        claim = await run_in_threadpool(claims.claim, place)
    except KeyInUseError:
        raise ProblemError(
            problem("key-in-use", "a request with this Idempotency-Key is under way"),
            {"Retry-After": str(context.settings.retry_after)},
        ) from None
    try:
        if claim.job_id is None:
            await run_in_threadpool(_require_room, context, sender)
        async with prolonged(claims, claim):
            yield claim
    finally:
        # A claim that cannot be given up runs out. The request has been answered by then: what is
        # accepted stays so.
        with suppress(RedisError):
            await run_in_threadpool(claims.release, claim)


@asynccontextmanager
async def prolonged(
    claims: KeyClaims, claim: Claim, every: float = CLAIM_SECONDS / 4
) -> AsyncIterator[None]:
    """Have a claim last for as long as its request does: files can take minutes to come."""

    async def prolong() -> None:
        while True:
            await asyncio.sleep(every)
            with suppress(RedisError):  # the broker may be back before the claim has run out
                await run_in_threadpool(claims.prolong, claim)

    task = asyncio.create_task(prolong())
    try:
        yield
    finally:
        task.cancel()
        await asyncio.wait([task])


def _require_room(context: ContextDependency, sender: Sender) -> None:
    # The ledger decides; this only spares a client the sending of files nobody will take.
    # While the broker is away a form is still told what is wrong with it.
    with suppress(RedisError):
        capacity = context.settings.queue_capacity
        if not context.ledger.index.has_room(capacity, sender.project, sender.owner):
            raise queue_full()


# Released before the answer is sent: whoever has it may use the key again at once.
ClaimDependency = Annotated[Claim | None, Depends(_claim, scope="function")]
