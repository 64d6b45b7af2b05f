"""Which webhooks are to be sent, and when: kept in the broker, so that none is forgotten.

The ledger writes them to its outbox. Here each gets a time at which it is due. Who takes one
moves its time beyond what sending can take: if that process dies, it is due again. So every
message is sent at least once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import structlog

from worker.jobs.ledger_keys import COUNTERS, WEBHOOKS
from worker.jobs.outbox import DROPPED, KEPT, Message
from worker.jobs.records import FINAL_STATES

if TYPE_CHECKING:
    from redis.asyncio import Redis

Outcome = Literal["delivered", "given_up", "dropped"]
"""What can become of a webhook; the ledger counts each as ``webhooks:OUTCOME``."""

DUE = "meshcone:webhooks:due"
MESSAGES = "meshcone:webhooks:messages"
TRIES = "meshcone:webhooks:tries"
_KEYS = (WEBHOOKS, DUE, MESSAGES, TRIES, COUNTERS)
_AT_ONCE = 100  # entries of the stream

logger = structlog.get_logger(__name__)

_NOW = """
local time = redis.call('TIME')
local now = tonumber(time[1]) + tonumber(time[2]) / 1e6
"""

_COLLECT = (
    _NOW
    + f"""
-- ARGV: entries at most, messages kept at most, then the states that are told of.
-- Answers how many entries there were, and why others than these became no message.
local told, lost = {{}}, {{}}
for index = 3, #ARGV do told[ARGV[index]] = true end

-- Versions before the outbox wrote every step of a job, and left the rest to be looked up.
local function looked_up(step, time)
  local job = 'meshcone:job:' .. step.job
  local url = redis.call('HGET', job, 'webhook')
  if not url then error('its job has been deleted', 0) end
  return cjson.encode({{
    id=step.job .. '_' .. step.state .. '_' .. step.attempt,
    job=step.job, state=step.state, attempt=tonumber(step.attempt), url=cjson.decode(url),
    owner=cjson.decode(redis.call('HGET', job, 'owner') or 'null'),
    labels=redis.call('HGET', job, 'labels') or '[]', milliseconds=time}})
end

local function read(step, time)
  local message = step.message
  if not message then
    if step.state and not told[step.state] then return end
    message = looked_up(step, time)
  end
  local id = cjson.decode(message).id
  if type(id) ~= 'string' then error('it has no id', 0) end
  return id, message
end

local entries = redis.call('XRANGE', KEYS[1], '-', '+', 'COUNT', ARGV[1])
for _, entry in ipairs(entries) do
  local step = {{}}
  for index = 1, #entry[2], 2 do step[entry[2][index]] = entry[2][index + 1] end
  -- Writing is left outside: what fails for want of memory is to be tried again.
  local is_sound, id, message = pcall(read, step, tonumber(string.match(entry[1], '%d+')))
  if not is_sound then
    lost[#lost + 1] = (step.job or entry[1]) .. ': ' .. (type(id) == 'table' and id.err or id)
  elseif id then
    redis.call('HSET', KEYS[3], id, message)
    redis.call('ZADD', KEYS[2], 'NX', string.format('%.6f', now), id)
  end
  redis.call('XDEL', KEYS[1], entry[1])
end
-- Of too many, those go first that are tried again last: they have failed most often.
local surplus = redis.call('ZCARD', KEYS[2]) - tonumber(ARGV[2])
if surplus > 0 then
  local popped = redis.call('ZPOPMAX', KEYS[2], surplus)
  for index = 1, #popped, 2 do
    redis.call('HDEL', KEYS[3], popped[index])
    redis.call('HDEL', KEYS[4], popped[index])
    lost[#lost + 1] = popped[index] .. ': more than ' .. ARGV[2] .. ' webhooks wait'
  end
end
if #lost > 0 then redis.call('HINCRBY', KEYS[5], '{DROPPED}', #lost) end
return {{#entries, lost}}
"""
)

_TAKE = (
    _NOW
    + """
-- ARGV: messages at most, seconds they are taken for
local taken = {}
for _, id in ipairs(redis.call('ZRANGEBYSCORE', KEYS[2], '-inf', string.format('%.6f', now),
                               'LIMIT', 0, ARGV[1])) do
  redis.call('ZADD', KEYS[2], string.format('%.6f', now + tonumber(ARGV[2])), id)
  local tries = redis.call('HINCRBY', KEYS[4], id, 1)
  taken[#taken + 1] = {id, redis.call('HGET', KEYS[3], id) or '', tries}
end
return taken
"""
)

_POSTPONE = (
    _NOW
    + """
-- ARGV: id, seconds
redis.call('ZADD', KEYS[2], 'XX', string.format('%.6f', now + tonumber(ARGV[2])), ARGV[1])
"""
)

_WAIT = (
    _NOW
    + """
local first = redis.call('ZRANGE', KEYS[2], 0, 0, 'WITHSCORES')
return first[2] and tostring(tonumber(first[2]) - now) or ''
"""
)


@dataclass(frozen=True)
class Taken:
    """A message to send now.

    Attributes:
        tries: how often it has been taken, this time included.
    """

    message: Message
    tries: int


class Schedule:
    """The messages of an installation; any number of processes may take them.

    Args:
        client: a connection whose replies are strings.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client
        self._collect = client.register_script(_COLLECT)
        self._take = client.register_script(_TAKE)
        self._postpone = client.register_script(_POSTPONE)
        self._wait = client.register_script(_WAIT)

    async def collect(self) -> None:
        """Take over what the ledger has written since; what cannot be read is dropped."""
        arguments = [_AT_ONCE, KEPT, *FINAL_STATES]
        found = _AT_ONCE
        while found == _AT_ONCE:
            found, lost = await self._collect(keys=_KEYS, args=arguments)
            for reason in lost:
                logger.error("webhook dropped", reason=reason)

    async def take(self, count: int, seconds: float) -> Sequence[Taken]:
        """Up to ``count`` messages that are due; nobody else gets them for some seconds.

        One that cannot be read is dropped, so that it keeps no other from being sent.
        """
        answer = await self._take(keys=_KEYS, args=[count, seconds])
        taken = []
        for message_id, text, tries in answer:
            try:
                taken.append(Taken(Message.decoded(text), int(tries)))
            except ValueError as error:
                logger.error("webhook dropped", message=message_id, reason=str(error))
                await self._forget(message_id, "dropped")
        return taken

    async def postpone(self, message: Message, seconds: float) -> None:
        """Have a message sent again later."""
        await self._postpone(keys=_KEYS, args=[message.id, seconds])

    async def settle(self, message: Message, outcome: Outcome) -> None:
        """Forget a message, and count what became of it."""
        await self._forget(message.id, outcome)

    async def _forget(self, message_id: str, outcome: Outcome) -> None:
        async with self._client.pipeline(transaction=True) as pipeline:
            pipeline.zrem(DUE, message_id)
            pipeline.hdel(MESSAGES, message_id)
            pipeline.hdel(TRIES, message_id)
            pipeline.hincrby(COUNTERS, f"webhooks:{outcome}", 1)
            await pipeline.execute()

    async def wait(self, seconds: float) -> None:
        """Wait until the ledger writes something, a message is due, or some seconds are over."""
        due = await self._wait(keys=_KEYS, args=[])
        pause = min(seconds, max(float(due), 0.01)) if due else seconds
        await self._client.xread({WEBHOOKS: "0"}, count=1, block=int(1000 * pause) or 1)
