"""Fetches the files of incomplete jobs, and tries again."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import structlog
from redis.exceptions import RedisError

from meshcone.errors import InternalError, MeshConeError
from worker.jobs.errors import TransitionRefusedError, UnknownJobError
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import FETCH_TRIES, FETCHES
from worker.jobs.lines import TAKE_FETCHES
from worker.jobs.records import JobError
from worker.outbound.due import TAKEN, Due, DueList, pause_before, work_through
from worker.storage.errors import FULL_DISK, StoreError, StoreFullError
from worker.transfers.errors import PassingError

if TYPE_CHECKING:
    from redis.asyncio import Redis

    from worker.jobs.queue import JobQueue
    from worker.transfers.settings import TransferSettings
    from worker.transfers.sources import Sources

logger = structlog.get_logger(__name__)

_AT_ONCE = 12  # jobs; a slow server must not hold up the others
_OF_A_PROJECT = 9  # of those, so that files of another are begun with, however slow its servers are
_GROWTH = 3  # of the pause before each further try: 2 s, 6 s, 18 s, 54 s
_ROOM_PAUSE = 10.0  # seconds until room on the disk is looked for again
_LOOK_INTERVAL = 0.1  # seconds; a job that waits for nothing else waits for this


@dataclass(frozen=True)
class Taken:
    """A job whose files are to be fetched now, and whose it is."""

    due: Due
    project: str


class Fetching:
    """Fetches what is due until it is told to stop.

    Args:
        client: a connection to the broker whose replies are strings.
        settings: how much, how often, and where from.
        ledger: where jobs and their files are entered.
        queue: where a job goes whose files are there.
        sources: fetches and stores the files of a job.
    """

    def __init__(
        self,
        client: Redis,
        settings: TransferSettings,
        *,
        ledger: Ledger,
        queue: JobQueue,
        sources: Sources,
    ) -> None:
        self._settings = settings
        self._ledger = ledger
        self._queue = queue
        self._sources = sources
        self._due = DueList(client, FETCHES, FETCH_TRIES)
        self._take = client.register_script(TAKE_FETCHES)
        self._in_hand: Counter[str] = Counter()  # jobs by project
        self._stopping = asyncio.Event()

    def stop(self) -> None:
        """End, and leave what is in hand to another process."""
        self._stopping.set()

    async def run(self) -> None:
        """Fetch until :meth:`stop` is called; a broker that is away is waited for."""
        await work_through(self, self._see_to, self._stopping, _AT_ONCE)
        await self._sources.close()

    async def take(self, count: int) -> Sequence[Taken]:
        """Up to ``count`` jobs that are due, or whose turn it is; the caller sees to each."""
        in_hand = json.dumps(+self._in_hand)
        answer = await self._take(args=[count, TAKEN, _OF_A_PROJECT, in_hand])
        taken = [Taken(Due(str(name), int(tries)), str(project)) for name, tries, project in answer]
        self._in_hand.update(each.project for each in taken)
        return taken

    async def wait(self, seconds: float) -> None:
        """Wait until there may be more to fetch, some seconds at most."""
        await asyncio.sleep(await self._due.seconds_until_next(min(seconds, _LOOK_INTERVAL)))

    async def _see_to(self, taken: Taken) -> None:
        try:
            await self._try(taken.due)
        finally:
            self._in_hand[taken.project] -= 1

    async def _try(self, due: Due) -> None:
        """Try once to complete a job, and note what came of it; nothing ends the process."""
        log = logger.bind(job_id=due.name, tries=due.tries)
        try:
            if due.tries > 2 * self._settings.fetch_attempts:  # its process ended by each
                raise InternalError("no try to fetch the files came to its end")
            await self._due.hold(due.name, self._complete(due.name), self._stopping)
        except (TransitionRefusedError, UnknownJobError) as refusal:
            log.info("fetched for nothing", reason=str(refusal))  # canceled meanwhile
        except RedisError as error:  # due again when its time is over
            log.error("the broker cannot be used", error=str(error))
        except (PassingError, StoreError, TimeoutError, OSError) as error:
            if isinstance(error, StoreFullError) or getattr(error, "errno", None) in FULL_DISK:
                await self._wait_for_room(due)
                return
            await self._try_again(due, _public(error, self._settings.fetch_seconds))
        except MeshConeError as error:
            await self._give_up(due, error)
        except Exception:  # a fault of ours; another try would only repeat it
            log.exception("fetching failed unexpectedly")
            await self._give_up(
                due, InternalError("an unexpected error in the service; it has been logged")
            )

    async def _complete(self, job_id: str) -> None:
        record = await asyncio.to_thread(self._ledger.get, job_id)
        async with asyncio.timeout(self._settings.fetch_seconds):
            complete = await self._sources.complete(record)
        await asyncio.to_thread(self._ledger.complete, complete)
        fetched = [file.size for file in complete.stored_files if file.origin is not None]
        logger.info("files fetched", job_id=job_id, files=len(fetched), bytes=sum(fetched))
        # Without its message, the reconciler sends another.
        await asyncio.to_thread(self._queue.enqueue, job_id)

    async def _wait_for_room(self, due: Due) -> None:
        """Leave it for a while, as if it had not been tried: nothing is wrong with the job."""
        logger.warning("no room for the files", job_id=due.name, again_in=_ROOM_PAUSE)
        with suppress(RedisError):
            await self._due.give_back(due.name)
            await self._due.postpone(due.name, _ROOM_PAUSE)

    async def _try_again(self, due: Due, error: MeshConeError) -> None:
        if due.tries >= self._settings.fetch_attempts:
            times = f"; it was tried {due.tries} times" if due.tries > 1 else ""
            await self._give_up(due, type(error)(error.message + times, file=error.file))
            return
        pause = pause_before(due.tries, self._settings.fetch_first_delay, _GROWTH)
        logger.warning(
            "files not fetched", job_id=due.name, reason=error.message, again_in=round(pause, 1)
        )
        with suppress(RedisError):
            await self._due.postpone(due.name, pause)

    async def _give_up(self, due: Due, error: MeshConeError) -> None:
        logger.warning("files given up", job_id=due.name, kind=error.kind, reason=error.message)
        with suppress(RedisError, TransitionRefusedError, UnknownJobError):
            await asyncio.to_thread(self._ledger.fail_incomplete, due.name, JobError.of(error))


def _public(error: Exception, seconds: float) -> MeshConeError:
    """What to tell of an error that may pass."""
    if isinstance(error, MeshConeError):
        return error
    if isinstance(error, TimeoutError):
        return PassingError(
            f"the files were not fetched within {seconds:g} s (MESHCONE_FETCH_SECONDS)"
        )
    if isinstance(error, StoreError):
        return InternalError(str(error))
    logger.error("a fetched file cannot be kept", error=str(error))
    return InternalError("the disk that fetched files are kept on cannot be used")
