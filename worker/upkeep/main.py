"""``python -m worker.upkeep.main``: reconciler and housekeeping, beside every worker.

A process of its own, because the file store's client has threads, and a worker forks. Of
all that run, the one that holds a short lock in the broker works; when it dies, another has
the lock seconds later.
"""

from __future__ import annotations

import logging
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

from redis.exceptions import LockError, RedisError
from redis.lock import Lock

from meshcone.lifeline import tied_command
from meshcone.settings import load_settings
from worker.broker.connections import connect_bytes, connect_text
from worker.broker.patience import OutageLog
from worker.jobs.batches import Batches, carry_through
from worker.jobs.full_broker import WHEN_FULL
from worker.jobs.heartbeats import Heartbeats
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.logs import configure_logging
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.errors import StoreError
from worker.storage.register import BlobRegister
from worker.upkeep.housekeeping import Housekeeper
from worker.upkeep.reconciler import Reconciler

if TYPE_CHECKING:
    from redis import Redis
    from redis.commands.core import Script

logger = logging.getLogger(__name__)

RECONCILER_LOCK = "meshcone:lock:reconciler"
HOUSEKEEPER_LOCK = "meshcone:lock:housekeeper"
HOUSEKEEPING_INTERVAL = 15.0  # seconds
_LOCK_INTERVALS = 3  # looks a holder may miss before another takes its place
_OTHERS_INTERVALS = 60.0  # seconds by which another host's settings may keep a lock for longer
_RESTART_PAUSE = 1.0  # seconds


_TAKE = (
    WHEN_FULL
    + """
return redis.call('SET', KEYS[1], ARGV[1], 'NX', 'PX', ARGV[2]) and 1 or 0
"""
)


class _Lock(Lock):
    """A lock that is had at the broker's memory limit too: its holder is to make room."""

    take: Script

    def do_acquire(self, token: str | bytes) -> bool:
        return bool(self.take([self.name], [token, int(1000 * float(self.timeout or 0))]))


class Turn:
    """A lock in the broker that is kept while its holder comes back often enough."""

    def __init__(self, client: Redis, name: str, seconds: float) -> None:
        self._client = client
        self.name = name
        self._longest = int((seconds + _OTHERS_INTERVALS) * 1000)
        self._lock = _Lock(client, name, timeout=seconds, blocking=False, thread_local=False)
        self._lock.take = client.register_script(_TAKE)

    def is_ours(self) -> bool:
        """Keep it if we hold it, else try to get it."""
        # The broker's clock was set back: the lock would outlive its holder by as much.
        if self._client.pttl(self.name) > self._longest:
            self._client.delete(self.name)
        with suppress(LockError):  # it ran out in this very moment
            if self._lock.owned():
                return bool(self._lock.reacquire())
        return bool(self._lock.acquire())


def every(seconds: float, turn: Turn, work: Callable[[], None], missed: Callable[[], None]) -> None:
    """Work at an interval, for ever, whenever it is our turn; else say it was missed."""
    outage = OutageLog()
    while True:
        try:
            if turn.is_ours():
                work()
            else:
                missed()
            outage.is_back()
        except RedisError as error:
            outage.is_away(error)
            missed()
        except StoreError as error:
            logger.error("%s", error)
        except Exception:  # a fault of ours: what can be done is done at the next look
            logger.exception("%s failed unexpectedly; it is tried again", turn.name)
            missed()
        time.sleep(seconds)


def main() -> None:
    """Reconcile and keep house until ended.

    Raises:
        InputError: the environment's settings cannot be used.
    """
    configure_logging()
    settings = load_settings(WorkerSettings)
    url = settings.required_redis_url()
    client = connect_text(url)
    ledger, batches = Ledger(client), Batches(client)
    queue = JobQueue(settings, connect_bytes(url))
    housekeeper = Housekeeper(
        settings,
        ledger=ledger,
        batches=batches,
        queue=queue,
        blobs=BlobStore.open(settings, BlobRegister(client)),
    )
    # A file store that hangs must not keep the reconciler from its work.
    threading.Thread(
        target=every,
        args=(
            HOUSEKEEPING_INTERVAL,
            Turn(client, HOUSEKEEPER_LOCK, _LOCK_INTERVALS * HOUSEKEEPING_INTERVAL),
            housekeeper.tidy,
            lambda: None,
        ),
        daemon=True,
    ).start()
    heartbeats = Heartbeats(client, settings.heartbeat_timeout)
    reconciler = Reconciler(ledger, queue, heartbeats, settings.attempts)

    def look() -> None:
        for batch_id in batches.open():  # whoever accepted it may have died
            carry_through(batch_id, batches, queue)
        reconciler.reconcile()

    interval = settings.reconcile_interval
    turn = Turn(client, RECONCILER_LOCK, _LOCK_INTERVALS * interval)
    every(interval, turn, look, reconciler.forget)


class UpkeepProcess:
    """The process, as its worker keeps it."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._started_at = float("-inf")

    def keep(self) -> None:
        """Start it if it does not run. It ends with this process, however that ends."""
        if self._process is not None and self._process.poll() is None:
            return
        if time.monotonic() - self._started_at < _RESTART_PAUSE:
            return
        if self._process is not None:
            logger.error("reconciler and housekeeping ended unexpectedly; starting them again")
        self._started_at = time.monotonic()
        self._process = subprocess.Popen(  # noqa: S603 - our own program
            tied_command([sys.executable, "-P", "-m", __spec__.name], signal.SIGKILL),
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )

    def end(self) -> None:
        """End it, if it runs."""
        if self._process is not None:
            self._process.terminate()
            self._process.wait()


if __name__ == "__main__":
    main()
