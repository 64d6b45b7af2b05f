"""Sends webhooks, and sends them again."""

from __future__ import annotations

import asyncio
import random
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import httpcore2
import structlog
from redis.exceptions import RedisError

from worker.webhooks.addresses import PublicBackend
from worker.webhooks.schedule import Schedule, Taken
from worker.webhooks.signing import SECRETS, signed_headers

if TYPE_CHECKING:
    from redis.asyncio import Redis

    from worker.jobs.outbox import Message
    from worker.webhooks.settings import WebhookSettings

logger = structlog.get_logger(__name__)

_AT_ONCE = 32  # deliveries; a slow receiver must not hold up the others
_GROWTH = 6  # of the pause before each further try: 5 s, 30 s, 3 min, 18 min, 1.8 h, 10.8 h
_JITTER = 0.2  # share of a pause, so that what failed together is not sent together
_LOOK_INTERVAL = 5.0  # seconds
_BROKER_PAUSE = 1.0  # seconds
_GONE = 410  # HTTP status by which a receiver says that it wants no more


@dataclass(frozen=True)
class _Failure:
    """Why a message was not received, and whether it is of use to send it again."""

    reason: str
    is_final: bool = False


class Delivery:
    """Sends what is due until it is told to stop.

    Args:
        client: a connection to the broker whose replies are strings.
        settings: how often, how long, and where to.
    """

    def __init__(self, client: Redis, settings: WebhookSettings) -> None:
        self._client = client
        self._settings = settings
        self._schedule = Schedule(client)
        self._stopping = asyncio.Event()
        # No connection is kept: each is made to an address that was checked for it.
        self._pool = httpcore2.AsyncConnectionPool(
            network_backend=PublicBackend(private_addresses=settings.webhook_private_addresses),
            max_connections=_AT_ONCE,
            max_keepalive_connections=0,
        )

    def stop(self) -> None:
        """End after the deliveries in hand."""
        self._stopping.set()

    async def run(self) -> None:
        """Send until :meth:`stop` is called; a broker that is away is waited for."""
        sending: set[asyncio.Task[None]] = set()
        stopped = asyncio.create_task(self._stopping.wait())
        while not self._stopping.is_set():
            taken = await self._due(_AT_ONCE - len(sending))
            for each in taken:
                task = asyncio.create_task(self._deliver(each))
                sending.add(task)
                task.add_done_callback(sending.discard)
            waiting = asyncio.create_task(self._wait(full=len(sending) >= _AT_ONCE))
            await asyncio.wait({stopped, waiting}, return_when=asyncio.FIRST_COMPLETED)
            waiting.cancel()
            with suppress(asyncio.CancelledError):
                await waiting
        await asyncio.gather(*sending)
        await self._pool.aclose()

    async def _due(self, count: int) -> list[Taken]:
        if count <= 0:
            return []
        try:
            await self._schedule.collect()
            return list(await self._schedule.take(count, 2 * self._settings.webhook_timeout + 10))
        except RedisError as error:
            logger.error("the broker cannot be used", error=str(error))
            await asyncio.sleep(_BROKER_PAUSE)
            return []

    async def _wait(self, *, full: bool) -> None:
        if full:
            await asyncio.sleep(0.1)
            return
        try:
            await self._schedule.wait(_LOOK_INTERVAL)
        except RedisError:
            await asyncio.sleep(_BROKER_PAUSE)

    async def _deliver(self, taken: Taken) -> None:
        """Send a message once, and note what came of it; nothing that it does ends the process."""
        message, log = taken.message, logger.bind(job_id=taken.message.job, tries=taken.tries)
        attempts = self._settings.webhook_attempts
        try:
            if taken.tries > 2 * attempts:  # each as good as tried, and its process ended by it
                failure: _Failure | None = _Failure("attempts were begun and never ended", True)
            else:
                failure = await self._send(message)
            if failure is None:
                log.info("webhook delivered")
                await self._schedule.settle(message, "delivered")
            elif failure.is_final or taken.tries >= attempts:
                log.error("webhook given up", reason=failure.reason)
                await self._schedule.settle(message, "given_up")
            else:
                pause = self._pause(taken.tries)
                log.warning(
                    "webhook not delivered", reason=failure.reason, again_in=round(pause, 1)
                )
                await self._schedule.postpone(message, pause)
        except RedisError as error:  # due again when its time is over
            log.error("the broker cannot be used", error=str(error))

    def _pause(self, tries: int) -> float:
        spread = 1 + random.uniform(-_JITTER, _JITTER)  # noqa: S311 - nothing is kept secret by it
        return float(self._settings.webhook_first_delay) * float(_GROWTH) ** (tries - 1) * spread

    async def _send(self, message: Message) -> _Failure | None:
        """Send a message once; None if it was received."""
        try:
            secret = await self._secret(message)
            if secret is None:
                return _Failure("there is no secret to sign it with any more", is_final=True)
            async with asyncio.timeout(self._settings.webhook_timeout):
                status = await self._post(message, secret)
        except (RedisError, httpcore2.NetworkError, httpcore2.ProtocolError) as error:
            return _Failure(f"{type(error).__name__}: {error}")
        except (TimeoutError, httpcore2.TimeoutException):
            return _Failure(f"no answer within {self._settings.webhook_timeout:g} s")
        except Exception as error:  # a fault of ours, or a secret nobody checked
            logger.exception("webhook failed unexpectedly", job_id=message.job)
            return _Failure(f"unexpected {type(error).__name__}: {error}")
        if 200 <= status < 300:
            return None
        # A redirect is a failure like others: it is not followed.
        return _Failure(f"status {status}", is_final=status == _GONE)

    async def _post(self, message: Message, secret: str) -> int:
        body = message.body()
        headers = {
            **signed_headers(message, body, secret),
            "content-type": "application/json",
            "user-agent": "meshcone-webhooks",
            "connection": "close",
        }
        request = self._pool.stream(
            "POST", message.url, headers=list(headers.items()), content=body
        )
        async with request as response:
            return int(response.status)

    async def _secret(self, message: Message) -> str | None:
        if message.owner is None:
            return self._settings.webhook_secret
        stored = await self._client.hget(SECRETS, message.owner)
        return None if stored is None else str(stored)
