"""The bytes that are fetched for jobs, counted against the jobs' senders.

Uploads are counted when they are let in; what is fetched is counted before it is stored, against
the same numbers of the same day. What a try has taken is noted with the job until its files are all
there. A further try gives that back first, and so does the step by which the job ends without them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict

from meshcone.errors import LimitError
from worker.jobs.ledger_keys import FETCHED_BYTES, FETCHES

if TYPE_CHECKING:
    from redis import Redis

DAY = 86_400
"""Seconds for which bytes are counted, from the first of them."""


class ByteAccount(BaseModel):
    """A number of bytes that may be sent a day.

    Attributes:
        place: where the broker counts them.
        whose: ``key`` or ``project``.
        limit: how many there may be; 0 for any number.
    """

    model_config = ConfigDict(frozen=True)

    place: str
    whose: str
    limit: int


GIVE_BACK = f"""
-- What was taken counts in the day in which it was taken, and in no later one.
local function give_back_fetched(id)
  local taken = redis.call('HGET', '{FETCHED_BYTES}', id)
  if not taken then return end
  for place, each in pairs(cjson.decode(taken)) do
    if redis.call('EXPIRETIME', place) == each.day then
      redis.call('DECRBY', place, each.bytes)
    end
  end
  redis.call('HDEL', '{FETCHED_BYTES}', id)
end
"""
"""Lua: ``give_back_fetched(id)``, for the ledger's scripts."""

_TAKE = f"""
-- ARGV: job, bytes, day in seconds. Answers the account that has not so many left, from 1, and the
-- seconds until it has; 0 if they are taken, -1 if nothing is to be fetched for the job any more.
local id, bytes = ARGV[1], tonumber(ARGV[2])
if not redis.call('ZSCORE', '{FETCHES}', id) then return {{-1, 0}} end
local accounts = cjson.decode(redis.call('HGET', 'meshcone:job:' .. id, 'fetch_accounts') or '[]')
for index, account in ipairs(accounts) do
  local used = tonumber(redis.call('GET', account.place) or '0')
  if account.limit > 0 and used + bytes > account.limit then
    return {{index, math.max(redis.call('TTL', account.place), 1)}}
  end
end
local taken = cjson.decode(redis.call('HGET', '{FETCHED_BYTES}', id) or '{{}}')
for _, account in ipairs(accounts) do
  local place = account.place
  redis.call('INCRBY', place, bytes)
  redis.call('EXPIRE', place, ARGV[3], 'NX')
  local day, before = redis.call('EXPIRETIME', place), taken[place]
  taken[place] = {{day=day, bytes=bytes + (before and before.day == day and before.bytes or 0)}}
end
if #accounts > 0 then redis.call('HSET', '{FETCHED_BYTES}', id, cjson.encode(taken)) end
return {{0, 0}}
"""

_GIVE_BACK = f"{GIVE_BACK}\ngive_back_fetched(ARGV[1])"


@dataclass(frozen=True)
class _Refusal:
    account: ByteAccount
    seconds: int

    def error(self) -> LimitError:
        hours = max(1, round(self.seconds / 3600))
        later = f"{hours} {'hour' if hours == 1 else 'hours'}"
        return LimitError(
            f"the {self.account.limit} bytes that this {self.account.whose} may send or have "
            f"fetched a day are used up; submit the job again in {later}"
        )


class FetchAccounts:
    """Counts what is fetched.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._take = client.register_script(_TAKE)
        self._give_back = client.register_script(_GIVE_BACK)

    def take(self, job_id: str, accounts: tuple[ByteAccount, ...], size: int) -> None:
        """Count a file of an incomplete job before it is stored.

        Args:
            job_id: the job.
            accounts: those of its record.
            size: of the file, in bytes.

        Raises:
            LimitError: an account has not so many bytes left; nothing is taken.
        """
        if not accounts:
            return
        found, seconds = self._take(args=[job_id, size, DAY])
        if found > 0:
            raise _Refusal(accounts[int(found) - 1], int(seconds)).error()

    def give_back(self, job_id: str) -> None:
        """Take nothing of what earlier tries have taken."""
        self._give_back(args=[job_id])
