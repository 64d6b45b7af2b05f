"""Which webhooks are to be sent, and when: kept in the broker, so that none is forgotten.

The ledger writes them to its outbox. Here each gets a time at which it is due. Who takes one
moves its time beyond what sending can take, so that every message is sent at least once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import structlog

from worker.jobs.ledger_keys import COUNTERS, WEBHOOKS
from worker.jobs.outbox import DROPPED, KEPT, Message
from worker.jobs.project_scripts import PROJECT
from worker.jobs.records import FINAL_STATES
from worker.outbound.due import DueList
from worker.outbound.shares import Shares

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

_COLLECT = f"""
local time = redis.call('TIME')
local now = tonumber(time[1]) + tonumber(time[2]) / 1e6

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
        of_a_project: messages of one project that are taken and not released yet, at most.
    """

    def __init__(self, client: Redis, of_a_project: int = KEPT) -> None:
        self._client = client
        self._collect = client.register_script(_COLLECT)
        self._due = DueList(client, DUE, TRIES)
        self._shares = Shares(client, DUE, TRIES, PROJECT, of_a_project)

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

        Each is to be released when nothing more is done for it.

        One that cannot be read is dropped, so that it keeps no other from being sent.
        """
        due = await self._shares.take(count, seconds)
        texts = await self._client.hmget(MESSAGES, [each.name for each in due]) if due else []
        taken = []
        for each, text in zip(due, texts, strict=True):
            try:
                taken.append(Taken(Message.decoded(str(text or "")), each.tries))
            except ValueError as error:
                logger.error("webhook dropped", message=each.name, reason=str(error))
                self._shares.release(each.name)
                await self._forget(each.name, "dropped")
        return taken

    def release(self, message: Message) -> None:
        """Let the project of a message that was taken have another in hand."""
        self._shares.release(message.id)

    async def postpone(self, message: Message, seconds: float) -> None:
        """Have a message sent again later."""
        await self._due.postpone(message.id, seconds)

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
        pause = await self._due.seconds_until_next(seconds)
        await self._client.xread({WEBHOOKS: "0"}, count=1, block=int(1000 * pause) or 1)
