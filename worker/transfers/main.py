"""The process that fetches files and puts results."""

from __future__ import annotations

import asyncio
import signal

from meshcone.settings import load_settings
from worker.broker.connections import connect_async, connect_bytes, connect_text
from worker.jobs.fetch_accounts import FetchAccounts
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.logs import configure_logging
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister
from worker.transfers.delivering import Delivering
from worker.transfers.fetching import Fetching
from worker.transfers.settings import TransferSettings
from worker.transfers.sources import Sources


def main() -> None:
    """Work until SIGTERM or SIGINT; files that are being fetched are left to the next process.

    Raises:
        InputError: the environment's settings cannot be used.
    """
    configure_logging()
    settings = load_settings(TransferSettings)
    asyncio.run(_transfer(settings, settings.required_redis_url()))


async def _transfer(settings: TransferSettings, url: str) -> None:
    with connect_text(url) as text, connect_bytes(url) as plain:
        register = BlobRegister(text)
        ledger, blobs = Ledger(text), BlobStore.open(settings, register)
        async with connect_async(url) as client:
            fetching = Fetching(
                client,
                settings,
                ledger=ledger,
                queue=JobQueue(settings, plain),
                sources=Sources(settings, blobs, register, FetchAccounts(text)),
            )
            delivering = Delivering(client, settings, ledger=ledger, blobs=blobs)
            loop = asyncio.get_running_loop()
            for number in (signal.SIGTERM, signal.SIGINT):
                loop.add_signal_handler(number, _stop, fetching, delivering)
            await asyncio.gather(fetching.run(), delivering.run())


def _stop(fetching: Fetching, delivering: Delivering) -> None:
    fetching.stop()
    delivering.stop()
