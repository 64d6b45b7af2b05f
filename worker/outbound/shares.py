"""What is due of all projects, of which none takes every place: its receivers may be slow."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

from worker.outbound.due import TAKEN, Due

if TYPE_CHECKING:
    from redis.asyncio import Redis

LOOKED_AT = 1000
"""Due names among which those are looked for whose project may have one more in hand."""

_TAKE = f"""
-- ARGV: names at most; seconds they are taken for; how many of a project the caller may have in
-- hand, and how many it has, by project. A name begins with the id of its job or batch; those that
-- were deleted meanwhile are the default project's.
local time = redis.call('TIME')
local now = tonumber(time[1]) + tonumber(time[2]) / 1e6
local left, most, in_hand = tonumber(ARGV[1]), tonumber(ARGV[3]), cjson.decode(ARGV[4])
local taken = {{}}
for _, name in ipairs(redis.call('ZRANGEBYSCORE', KEYS[1], '-inf', string.format('%.6f', now),
                                 'LIMIT', 0, {LOOKED_AT})) do
  if left == 0 then break end
  local id = string.match(name, '^[^/_]*')
  local job = 'meshcone:job:' .. id
  local is_job = redis.call('EXISTS', job) == 1
  local project = project_of(is_job and job or 'meshcone:batch:' .. id)
  local has = in_hand[project] or 0
  if has < most then
    in_hand[project], left = has + 1, left - 1
    redis.call('ZADD', KEYS[1], string.format('%.6f', now + tonumber(ARGV[2])), name)
    taken[#taken + 1] = {{name, redis.call('HINCRBY', KEYS[2], name, 1), project}}
  end
end
return taken
"""


class Shares:
    """Takes names of a :class:`worker.outbound.due.DueList`, not too many of one project at once.

    Args:
        client: a connection whose replies are strings.
        times: key of the sorted set of names by the time at which they are due.
        tries: key of the hash of how often each has been taken.
        project_of: Lua that has the function of this name, of the key of a job or a batch.
        most: names of one project in hand at one time.
    """

    def __init__(self, client: Redis, times: str, tries: str, project_of: str, most: int) -> None:
        self._keys = (times, tries)
        self._take = client.register_script(project_of + _TAKE)
        self._most = most
        self._in_hand: dict[str, str] = {}  # projects by name

    async def take(self, count: int, seconds: float = TAKEN) -> Sequence[Due]:
        """Up to ``count`` names that are due; each is to be released when it is out of hand."""
        in_hand = json.dumps(Counter(self._in_hand.values()))
        answer = await self._take(keys=self._keys, args=[count, seconds, self._most, in_hand])
        self._in_hand.update({str(name): str(project) for name, _, project in answer})
        return [Due(str(name), int(tries)) for name, tries, _ in answer]

    def release(self, name: str) -> None:
        """Let the project of a name have another in hand."""
        self._in_hand.pop(name, None)
