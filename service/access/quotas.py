"""What each API key, and each project, may use: requests a minute, jobs at a time, bytes a day.

The broker counts, so that all API processes count together; each count is one script, so
that two requests cannot both take the last place. Requests are paced by the generic cell
rate algorithm: one number a key, no window whose end lets twice the limit pass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import structlog
from redis.exceptions import RedisError

from service.problems import ProblemError, problem
from worker.jobs.fetch_accounts import DAY, ByteAccount
from worker.jobs.full_broker import WHEN_FULL

if TYPE_CHECKING:
    from collections.abc import Mapping

    from redis import Redis
    from redis.asyncio import Redis as AsyncRedis

    from service.access.keys import ApiKey, Quota
    from service.settings import ServiceSettings

WINDOW = 60  # seconds
_SETTLING = 60  # seconds after which a reservation whose request has not ended is looked into
_LOOKED_AT = 100  # jobs of a key without a limit, at each that it sends

logger = structlog.get_logger(__name__)

_PACE = f"""{WHEN_FULL}
-- KEYS[1]: when the requests so far would have come at an even pace. ARGV: limit, window. One
-- later than any request makes it is from before the broker's clock was set back.
local time = redis.call('TIME')
local now = tonumber(time[1]) + tonumber(time[2]) / 1e6
local window = tonumber(ARGV[2])
local interval = window / tonumber(ARGV[1])
local due = math.max(tonumber(redis.call('GET', KEYS[1]) or '0'), now)
if due > now + window + interval then due = now end
local wait = due + interval - window - now
if wait > 1e-6 then return {{0, 0, math.ceil(wait)}} end
due = due + interval
redis.call('SET', KEYS[1], string.format('%.6f', due), 'EX', math.ceil(due - now))
return {{1, math.floor((window - (due - now)) / interval + 1e-6), math.ceil(due - now)}}
"""

# KEYS of what follows: the key's jobs by the time they were let in; its bytes of the day; what
# is reserved for requests under way, by job: 'BYTES/END OF THE DAY THEY COUNT IN/TIME'; its batches
# not all of whose jobs are entered. Entering one counts it among the jobs, in the same step.
_ACCOUNT = """
local time = tonumber(redis.call('TIME')[1])

local function is_known(id)
  return redis.call('EXISTS', 'meshcone:job:' .. id, 'meshcone:batch:' .. id) > 0
end

local function entry_of(id)
  return 'meshcone:batch:' .. id .. ':entry'
end

-- How many jobs of its batches are not entered yet; a batch without any is done with.
local function not_entered()
  local sum = 0
  for _, id in ipairs(redis.call('SMEMBERS', KEYS[4])) do
    local left = redis.call('LLEN', entry_of(id))
    if left == 0 then redis.call('SREM', KEYS[4], id) end
    sum = sum + left
  end
  return sum
end

local function reservation(text)
  local bytes, day, since = string.match(text, '(%d+)/(%d+)/(%d+)')
  return tonumber(bytes), tonumber(day), tonumber(since)
end

local function count(id, bytes, day_length)
  if redis.call('EXISTS', entry_of(id)) == 1 then
    redis.call('SADD', KEYS[4], id)
    redis.call('EXPIRE', KEYS[4], 30 * day_length)
  elseif redis.call('EXISTS', 'meshcone:batch:' .. id) == 0 then
    redis.call('ZADD', KEYS[1], time, id)
    redis.call('EXPIRE', KEYS[1], 30 * day_length)
  end
  redis.call('INCRBY', KEYS[2], bytes)
  redis.call('EXPIRE', KEYS[2], day_length, 'NX')
end

local function give_back(id, bytes, day)
  redis.call('ZREM', KEYS[1], id)
  redis.call('SREM', KEYS[4], id)
  if redis.call('EXPIRETIME', KEYS[2]) == day then redis.call('DECRBY', KEYS[2], bytes) end
end
"""

_RESERVE = (
    _ACCOUNT
    + f"""
-- ARGV: id of a job or of a staged batch, bytes, jobs allowed, bytes allowed (0 for any number),
--       day in seconds, seconds after which a reservation is looked into, jobs that it is or has
local jobs, bytes, day_length = tonumber(ARGV[3]), tonumber(ARGV[4]), tonumber(ARGV[5])
local overdue = time - tonumber(ARGV[6])
if redis.call('HEXISTS', KEYS[3], ARGV[1]) == 1 then return {{'', 0}} end  -- its answer was lost
local reserved = redis.call('HGETALL', KEYS[3])
for index = 1, #reserved, 2 do
  local id = reserved[index]
  local size, day, since = reservation(reserved[index + 1])
  if since > time then since = overdue - 1 end  -- the broker's clock was set back since
  if since < time - day_length or (since < overdue and is_known(id)) then
    redis.call('HDEL', KEYS[3], id)
  elseif since < overdue and size > 0 then
    -- Its process has died, or is slow: then it is counted again when the job is known.
    give_back(id, size, day)
    redis.call('HSET', KEYS[3], id, string.format('0/%d/%d', day, since))
  end
end
local more = not_entered() + tonumber(ARGV[7])
-- The ledger says what became of them: a count of our own could drift from it.
local function take_out_ended(last)
  for _, id in ipairs(redis.call('ZRANGE', KEYS[1], 0, last)) do
    local state = redis.call('HGET', 'meshcone:job:' .. id, 'state')
    local is_active = state == 'queued' or state == 'running'
    if not state then  -- not known yet, or deleted
      is_active = redis.call('HEXISTS', KEYS[3], id) == 1
          and tonumber(redis.call('ZSCORE', KEYS[1], id)) >= overdue
    end
    if not is_active then redis.call('ZREM', KEYS[1], id) end
  end
end
-- Without a limit the oldest are looked at, so that those that have ended do not gather.
if jobs == 0 then take_out_ended({_LOOKED_AT - 1}) end
if jobs > 0 and redis.call('ZCARD', KEYS[1]) + more > jobs then
  take_out_ended(-1)
  if redis.call('ZCARD', KEYS[1]) + more > jobs then return {{'jobs', 0}} end
end
local used = tonumber(redis.call('GET', KEYS[2]) or '0')
if bytes > 0 and used + tonumber(ARGV[2]) > bytes then
  return {{'bytes', math.max(redis.call('TTL', KEYS[2]), 1)}}
end
count(ARGV[1], ARGV[2], day_length)
local day = redis.call('EXPIRETIME', KEYS[2])
redis.call('HSET', KEYS[3], ARGV[1], string.format('%d/%d/%d', ARGV[2], day, time))
redis.call('EXPIRE', KEYS[3], 2 * day_length)
return {{'', 0}}
"""
)

_SETTLE = (
    _ACCOUNT
    + """
-- ARGV: job id, bytes, day in seconds
local reserved = redis.call('HGET', KEYS[3], ARGV[1])
if not reserved then return end
redis.call('HDEL', KEYS[3], ARGV[1])
local size, day = reservation(reserved)
if not is_known(ARGV[1]) then
  give_back(ARGV[1], size, day)
elseif size == 0 then
  count(ARGV[1], ARGV[2], tonumber(ARGV[3]))
end
"""
)


@dataclass(frozen=True)
class Allowance:
    """A quota with the installation's own values where the key has none; 0 is no limit."""

    requests_per_minute: int
    active_jobs: int
    daily_bytes: int

    @classmethod
    def of(cls, quota: Quota, settings: ServiceSettings) -> Allowance:
        """What a key may use here."""

        def chosen(own: int | None, default: int) -> int:
            return default if own is None else own

        return cls(
            chosen(quota.requests_per_minute, settings.key_requests_per_minute),
            chosen(quota.active_jobs, settings.key_active_jobs),
            chosen(quota.daily_bytes, settings.key_daily_bytes),
        )


@dataclass(frozen=True)
class Pace:
    """Where a key stands after a request.

    Attributes:
        allowed: whether the request may pass.
        limit: requests a minute.
        remaining: requests that could follow at once.
        seconds: until all of them are there again or, if it may not pass, until one is.
    """

    allowed: bool
    limit: int
    remaining: int
    seconds: int

    def headers(self) -> Mapping[str, str]:
        """The fields of draft-ietf-httpapi-ratelimit-headers-10, and Retry-After if refused."""
        fields = {
            "RateLimit-Policy": f'"requests";q={self.limit};w={WINDOW}',
            "RateLimit": f'"requests";r={self.remaining};t={self.seconds}',
        }
        return fields if self.allowed else {**fields, "Retry-After": str(self.seconds)}


class RateLimiter:
    """Paces the requests of each key.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: AsyncRedis) -> None:
        self._pace = client.register_script(_PACE)

    async def take(self, key_id: str, limit: int) -> Pace | None:
        """Count a request; None if any number is allowed."""
        if limit == 0:
            return None
        keys = [f"meshcone:pace:{key_id}"]
        allowed, remaining, seconds = await self._pace(keys=keys, args=[limit, WINDOW])
        return Pace(bool(allowed), limit, int(remaining), int(seconds))


@dataclass(frozen=True)
class _Account:
    """What is counted together, and how much of it there may be; 0 is no limit."""

    whose: str
    place: str
    active_jobs: int
    daily_bytes: int

    def keys(self) -> list[str]:
        return [f"{self.place}:{part}" for part in ("jobs", "bytes", "reserved", "batches")]


class JobQuotas:
    """Counts the jobs and the bytes of each key, and of all keys of a project together.

    Args:
        client: a connection whose replies are strings.
        settings: what keys may use that have no quota of their own.
    """

    def __init__(self, client: Redis, settings: ServiceSettings) -> None:
        self._reserve = client.register_script(_RESERVE)
        self._settle = client.register_script(_SETTLE)
        self._settings = settings

    def reserve(self, key: ApiKey, job_id: str, size: int, jobs: int = 1) -> None:
        """Let a job, or a staged batch of jobs, of ``size`` bytes in, before it is known.

        :meth:`settle` has to follow. Where it does not, because its process has died, the
        reservation is settled by the key's next request that comes a minute later.

        Raises:
            ProblemError: the key or its project has too many jobs, or has sent too many bytes;
                it says when to try again.
        """
        accounts = self._accounts(key)
        for index, account in enumerate(accounts):
            try:
                self._reserve_in(account, job_id, size, jobs)
            except ProblemError:
                for reserved in accounts[:index]:
                    self._settle_in(reserved, job_id, size)
                raise

    def settle(self, key: ApiKey, job_id: str, size: int) -> None:
        """End a reservation: it is used if the ledger knows the job by now, else given back.

        A broker that is away is no error: what is reserved is then settled later.
        """
        for account in self._accounts(key):
            self._settle_in(account, job_id, size)

    def places(self, key: ApiKey) -> tuple[str, ...]:
        """Sorted sets in which the jobs of a key are counted, by the time they were let in."""
        return tuple(account.keys()[0] for account in self._accounts(key))

    def byte_accounts(self, key: ApiKey) -> tuple[ByteAccount, ...]:
        """Against what the bytes are counted that are fetched for a job of a key."""
        return tuple(
            ByteAccount(place=each.keys()[1], whose=each.whose, limit=each.daily_bytes)
            for each in self._accounts(key)
        )

    def _accounts(self, key: ApiKey) -> list[_Account]:
        own, settings = Allowance.of(key.quota, self._settings), self._settings
        of_key = _Account("key", f"meshcone:key:{key.id}", own.active_jobs, own.daily_bytes)
        limits = (settings.project_active_jobs, settings.project_daily_bytes)
        if not any(limits):
            return [of_key]
        return [of_key, _Account("project", f"meshcone:project:{key.project}:used", *limits)]

    def _reserve_in(self, account: _Account, job_id: str, size: int, jobs: int) -> None:
        limits = [account.active_jobs, account.daily_bytes, DAY, _SETTLING]
        arguments: list[Any] = [job_id, size, *limits, jobs]
        reason, seconds = self._reserve(keys=account.keys(), args=arguments)
        if reason == "jobs":
            raise _exceeded(
                f"{account.active_jobs} jobs of this {account.whose} are queued or running, "
                "which is its limit"
                if jobs == 1
                else f"the batch has {jobs} jobs, and this {account.whose} may have "
                f"{account.active_jobs} queued or running",
                self._settings.retry_after * 10,
            )
        if reason == "bytes":
            raise _exceeded(
                f"the {account.daily_bytes} bytes this {account.whose} may send a day are used up",
                math.ceil(float(seconds)),
            )

    def _settle_in(self, account: _Account, job_id: str, size: int) -> None:
        try:
            self._settle(keys=account.keys(), args=[job_id, size, DAY])
        except RedisError as error:
            logger.warning("a quota is settled later", job_id=job_id, reason=str(error))


def _exceeded(detail: str, seconds: int) -> ProblemError:
    return ProblemError(problem("quota", detail), {"Retry-After": str(seconds)})
