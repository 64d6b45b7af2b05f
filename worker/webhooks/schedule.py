"""Which webhooks are to be sent, and when: kept in the broker, so that none is forgotten.

The ledger's transitions write a stream. Here its entries become messages with a time at
which they are due. Who takes a message moves its time beyond what sending can take: if that
process dies, the message is due again. So every message is sent at least once.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from worker.jobs.ledger_keys import WEBHOOKS
from worker.jobs.records import FINAL_STATES
from worker.webhooks.messages import Message

if TYPE_CHECKING:
    from redis.asyncio import Redis

DUE = "meshcone:webhooks:due"
MESSAGES = "meshcone:webhooks:messages"
TRIES = "meshcone:webhooks:tries"
_KEYS = (WEBHOOKS, DUE, MESSAGES, TRIES)
_AT_ONCE = 100  # entries of the stream

_NOW = """
local time = redis.call('TIME')
local now = tonumber(time[1]) + tonumber(time[2]) / 1e6
"""

_COLLECT = (
    _NOW
    + """
-- ARGV: entries at most, then the states that are told of
local told = {}
for index = 2, #ARGV do told[ARGV[index]] = true end
local entries = redis.call('XRANGE', KEYS[1], '-', '+', 'COUNT', ARGV[1])
for _, entry in ipairs(entries) do
  local step = {}
  for index = 1, #entry[2], 2 do step[entry[2][index]] = entry[2][index + 1] end
  local job = 'meshcone:job:' .. step.job
  local url = redis.call('HGET', job, 'webhook')
  if told[step.state] and url and url ~= 'null' then
    local id = step.job .. '_' .. step.state .. '_' .. step.attempt
    local message = cjson.encode({
      id=id, job=step.job, state=step.state, attempt=tonumber(step.attempt),
      url=cjson.decode(url), owner=cjson.decode(redis.call('HGET', job, 'owner') or 'null'),
      milliseconds=tonumber(string.match(entry[1], '%d+')),
      labels=redis.call('HGET', job, 'labels') or '[]'})
    redis.call('HSET', KEYS[3], id, message)
    redis.call('ZADD', KEYS[2], 'NX', string.format('%.6f', now), id)
  end
  redis.call('XDEL', KEYS[1], entry[1])
end
return #entries
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
  taken[#taken + 1] = {redis.call('HGET', KEYS[3], id), tries}
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
        """Make messages of what the ledger has written since."""
        arguments = [_AT_ONCE, *FINAL_STATES]
        while await self._collect(keys=_KEYS, args=arguments) == _AT_ONCE:
            pass

    async def take(self, count: int, seconds: float) -> Sequence[Taken]:
        """Up to ``count`` messages that are due; nobody else gets them for some seconds."""
        answer = await self._take(keys=_KEYS, args=[count, seconds])
        return [Taken(_message(text), int(tries)) for text, tries in answer]

    async def postpone(self, message: Message, seconds: float) -> None:
        """Have a message sent again later."""
        await self._postpone(keys=_KEYS, args=[message.id, seconds])

    async def settle(self, message: Message) -> None:
        """Forget a message: it was received, or is given up."""
        async with self._client.pipeline(transaction=True) as pipeline:
            pipeline.zrem(DUE, message.id)
            pipeline.hdel(MESSAGES, message.id)
            pipeline.hdel(TRIES, message.id)
            await pipeline.execute()

    async def wait(self, seconds: float) -> None:
        """Wait until the ledger writes something, a message is due, or some seconds are over."""
        due = await self._wait(keys=_KEYS, args=[])
        pause = min(seconds, max(float(due), 0.01)) if due else seconds
        await self._client.xread({WEBHOOKS: "0"}, count=1, block=int(1000 * pause) or 1)


def _message(text: str) -> Message:
    found: dict[str, Any] = json.loads(text)
    at = datetime.fromtimestamp(found.pop("milliseconds") / 1000, UTC)
    labels = tuple(json.loads(found.pop("labels")))
    return Message(**{"owner": None, **found}, labels=labels, at=at)
