"""The process that delivers webhooks."""

from __future__ import annotations

import asyncio
import signal

from meshcone.settings import load_settings
from worker.broker.connections import connect_async
from worker.logs import configure_logging
from worker.webhooks.delivery import Delivery
from worker.webhooks.settings import WebhookSettings


def main() -> None:
    """Deliver until SIGTERM or SIGINT, and end after the deliveries in hand.

    Raises:
        InputError: the environment's settings cannot be used.
    """
    configure_logging()
    settings = load_settings(WebhookSettings)
    asyncio.run(_deliver(settings, settings.required_redis_url()))


async def _deliver(settings: WebhookSettings, url: str) -> None:
    async with connect_async(url) as client:
        delivery = Delivery(client, settings)
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGINT):
            loop.add_signal_handler(number, delivery.stop)
        await delivery.run()
