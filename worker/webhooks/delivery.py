"""Sends webhooks, and sends them again."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import TYPE_CHECKING

import httpcore2
import structlog
from redis.exceptions import RedisError

from worker.outbound.addresses import PublicBackend
from worker.outbound.due import pause_before, work_through
from worker.webhooks.schedule import Schedule, Taken
from worker.webhooks.signing import SECRETS, signed_headers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from redis.asyncio import Redis

    from worker.jobs.outbox import Message
    from worker.webhooks.settings import WebhookSettings

logger = structlog.get_logger(__name__)

_AT_ONCE = 32  # deliveries; a slow receiver must not hold up the others
_OF_A_PROJECT = 24  # of those, so that another is told of its jobs, however slow its receivers are
_GROWTH = 6  # of the pause before each further try: 5 s, 30 s, 3 min, 18 min, 1.8 h, 10.8 h
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
        self._schedule = Schedule(client, _OF_A_PROJECT)
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
        await work_through(self, self._deliver, self._stopping, _AT_ONCE)
        await self._pool.aclose()

    async def take(self, count: int) -> Sequence[Taken]:
        """Up to ``count`` messages that are due."""
        await self._schedule.collect()
        return await self._schedule.take(count, 2 * self._settings.webhook_timeout + 10)

    async def wait(self, seconds: float) -> None:
        """Wait until there may be more to send, some seconds at most."""
        await self._schedule.wait(seconds)

    async def _deliver(self, taken: Taken) -> None:
        try:
            await self._once(taken)
        finally:
            self._schedule.release(taken.message)

    async def _once(self, taken: Taken) -> None:
        """Send a message once, and note what came of it; nothing that it does ends the process."""
        message, log = taken.message, logger.bind(job_id=taken.message.job, tries=taken.tries)
        attempts = self._settings.webhook_attempts
        try:
            if taken.tries > 2 * attempts:  # each as good as tried, and its process ended by it
                failure: _Failure | None = _Failure("no attempt came to its end", True)
            else:
                failure = await self._send(message)
            if failure is None:
                log.info("webhook delivered")
                await self._schedule.settle(message, "delivered")
            elif failure.is_final or taken.tries >= attempts:
                log.error("webhook given up", reason=failure.reason)
                await self._schedule.settle(message, "given_up")
            else:
                pause = pause_before(taken.tries, self._settings.webhook_first_delay, _GROWTH)
                log.warning(
                    "webhook not delivered", reason=failure.reason, again_in=round(pause, 1)
                )
                await self._schedule.postpone(message, pause)
        except RedisError as error:  # due again when its time is over
            log.error("the broker cannot be used", error=str(error))

    async def _send(self, message: Message) -> _Failure | None:
        """Send a message once; None if it was received."""
        try:
            secret = await self._secret(message)
            if secret is None:
                return _Failure("there is no secret to sign it with any more", is_final=True)
            async with asyncio.timeout(self._settings.webhook_timeout):
                status = await self._post(message, secret)
        except httpcore2.LocalProtocolError:  # its words would quote a header
            return _Failure("HTTP does not allow a header or the URL of the request", is_final=True)
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
