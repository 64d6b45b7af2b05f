"""Puts what jobs have made where their senders want it, and tries again."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from typing import IO, TYPE_CHECKING, cast

import structlog
from redis.exceptions import ConnectionError as RedisConnectionError
from redis.exceptions import RedisError
from redis.exceptions import TimeoutError as RedisTimeoutError

from meshcone.errors import InternalError, MeshConeError
from worker.jobs.errors import UnknownJobError
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import DELIVERIES, DELIVERY_TRIES
from worker.jobs.project_scripts import PROJECT
from worker.outbound.due import Due, DueList, pause_before, work_through
from worker.outbound.shares import Shares
from worker.storage.errors import DamagedFileError, StoreError
from worker.transfers.buckets import Buckets
from worker.transfers.errors import PassingError
from worker.transfers.places import is_in_bucket, secret_for
from worker.transfers.web import Web

if TYPE_CHECKING:
    from redis.asyncio import Redis

    from worker.jobs.records import Artifact, JobRecord, Output, OutputName
    from worker.storage.blobs import BlobStore
    from worker.transfers.settings import TransferSettings

logger = structlog.get_logger(__name__)

_AT_ONCE = 8  # results; a slow server must not hold up the others
_OF_A_PROJECT = 6  # of those, so that results of another are put, however slow its servers are
_GROWTH = 6  # of the pause before each further try, as for webhooks
_LOOK_INTERVAL = 0.25  # seconds
_FAULT = "an unexpected error in the service; it was logged"


class Delivering:
    """Puts what is due until it is told to stop.

    Args:
        client: a connection to the broker whose replies are strings.
        settings: how often, how long, and where to.
        ledger: where jobs and what became of their outputs are entered.
        blobs: where the results are.
    """

    def __init__(
        self, client: Redis, settings: TransferSettings, *, ledger: Ledger, blobs: BlobStore
    ) -> None:
        self._settings = settings
        self._ledger = ledger
        self._blobs = blobs
        self._due = DueList(client, DELIVERIES, DELIVERY_TRIES)
        self._shares = Shares(client, DELIVERIES, DELIVERY_TRIES, PROJECT, _OF_A_PROJECT)
        self._web = Web(private_addresses=settings.transfer_private_addresses)
        self._buckets = Buckets(settings.output_buckets)
        self._stopping = asyncio.Event()

    def stop(self) -> None:
        """End, and leave what is in hand to another process."""
        self._stopping.set()

    async def run(self) -> None:
        """Put until :meth:`stop` is called; a broker that is away is waited for."""
        await work_through(self, self._see_to, self._stopping, _AT_ONCE)
        await self._web.close()

    async def take(self, count: int) -> Sequence[Due]:
        """Up to ``count`` results that are due."""
        return await self._shares.take(count)

    async def wait(self, seconds: float) -> None:
        """Wait until there may be more to put, some seconds at most."""
        await asyncio.sleep(await self._due.seconds_until_next(min(seconds, _LOOK_INTERVAL)))

    async def _see_to(self, due: Due) -> None:
        try:
            await self._once(due)
        finally:
            self._shares.release(due.name)

    async def _once(self, due: Due) -> None:
        """Try once to put a result, and note what came of it; nothing ends the process."""
        try:
            if due.tries > 2 * self._settings.output_attempts:  # its process ended by each
                raise InternalError("no try to put the result came to its end")
            await self._due.hold(due.name, self._try(due), self._stopping)
        except (UnknownJobError, KeyError):  # deleted meanwhile, and its files with it
            with suppress(RedisError):
                await self._due.forget(due.name)
        except RedisError as error:  # due again when its time is over
            logger.error("the broker cannot be used", error=str(error))
        except InternalError as error:
            await self._give_up(due, error.message)
        except Exception:  # a fault of ours; another try would only repeat it
            logger.exception("an output cannot be seen to", output=due.name)
            await self._give_up(due, _FAULT)

    async def _give_up(self, due: Due, detail: str) -> None:
        """End an output as well as can be: where that cannot be noted, it is tried no more."""
        try:
            record, name, tried = await self._wanted(due)
            ended = tried.ended("given_up", detail)
            await asyncio.to_thread(self._ledger.note_output, record.id, name, ended)
            logger.warning("output given up", job_id=record.id, output=name, **_told(ended, None))
        except (RedisConnectionError, RedisTimeoutError) as error:  # due again, and given up then
            logger.error("the broker cannot be used", error=str(error))
        except Exception:
            logger.exception("that an output is given up cannot be noted", output=due.name)
            with suppress(RedisError):
                await self._due.forget(due.name)

    async def _wanted(self, due: Due) -> tuple[JobRecord, OutputName, Output]:
        """The job of a result, the result's name, and what it is at this try."""
        job_id, _, name = cast("tuple[str, str, OutputName]", due.name.partition("/"))
        record = await asyncio.to_thread(self._ledger.get, job_id)
        return record, name, record.outputs[name].model_copy(update={"tries": due.tries})

    async def _try(self, due: Due) -> None:
        record, name, tried = await self._wanted(due)
        ended = await self._tried(due, tried, record.artifacts.get(name))
        pause = None
        if ended.state == "waiting":
            pause = pause_before(due.tries, self._settings.output_first_delay, _GROWTH)
        level = logger.info if ended.detail is None else logger.warning
        level("output seen to", job_id=record.id, output=name, **_told(ended, pause))
        await asyncio.to_thread(self._ledger.note_output, record.id, name, ended)
        if pause is not None:
            await self._due.postpone(due.name, pause)

    async def _tried(self, due: Due, output: Output, artifact: Artifact | None) -> Output:
        """What an output is after one more try."""
        if artifact is None:
            return output.ended("absent", "the job has made no such file")
        try:
            async with asyncio.timeout(self._settings.output_seconds):
                await self._put(output, artifact)
        except (PassingError, StoreError, DamagedFileError, OSError) as error:
            detail = _words(error, self._settings.output_seconds)
            if due.tries < self._settings.output_attempts:
                return output.model_copy(update={"detail": detail})
            return output.ended("given_up", detail)
        except MeshConeError as error:
            return output.ended("given_up", error.message)
        except Exception:  # a fault of ours; another try would only repeat it
            logger.exception("putting an output failed unexpectedly", output=due.name)
            return output.ended("given_up", _FAULT)
        return output.ended("delivered", None)

    async def _put(self, output: Output, artifact: Artifact) -> None:
        with tempfile.TemporaryFile() as content:
            await asyncio.to_thread(self._copy, artifact, content)
            if is_in_bucket(output.url):
                await self._buckets.put(output.url, content, artifact.media_type)
                return
            secret = None
            if output.authorization is not None:
                secret = secret_for(output.url, output.authorization, self._settings)
            await self._web.put(output.url, content, artifact.media_type, secret)

    def _copy(self, artifact: Artifact, content: IO[bytes]) -> None:
        content.writelines(self._blobs.chunks(artifact.digest))


def _told(output: Output, pause: float | None) -> dict[str, object]:
    told: dict[str, object] = {"state": output.state, "tries": output.tries}
    if output.detail is not None:
        told["reason"] = output.detail
    if pause is not None:
        told["again_in"] = round(pause, 1)
    return told


def _words(error: Exception, seconds: float) -> str:
    """What to tell of an error that may pass."""
    if isinstance(error, TimeoutError):
        return f"the receiver did not take it within {seconds:g} s (MESHCONE_OUTPUT_SECONDS)"
    if isinstance(error, FileNotFoundError):
        return "the job's files have expired"
    if isinstance(error, PassingError | StoreError | DamagedFileError):
        return str(error)
    logger.error("a result cannot be kept on its way", error=str(error))
    return "the disk that results are kept on in between cannot be used"
