"""How the broker counts who needs a blob; see :mod:`worker.storage.register`.

`references` has, by digest, how many jobs and leases need a blob, `generations` the second
half of its name in the store, `leases` when each ends, and `doomed` the names to be removed,
each with the time before which nobody is to do so.
"""

from __future__ import annotations

from worker.jobs.full_broker import WHEN_FULL
from worker.jobs.ledger_keys import (
    BLOB_GENERATIONS,
    BLOB_LEASES,
    BLOB_REFERENCES,
    DOOMED_BLOBS,
)

_NAME = f"""
-- A blob of an earlier version has no generation.
local function blob_name(digest)
  local generation = redis.call('HGET', '{BLOB_GENERATIONS}', digest)
  return generation and digest .. '.' .. generation or digest
end

local function is_needed(digest)
  return redis.call('HEXISTS', '{BLOB_GENERATIONS}', digest) == 1
      or redis.call('HEXISTS', '{BLOB_REFERENCES}', digest) == 1
end
"""

NEED = (
    _NAME
    + f"""
-- A blob is needed as often as jobs and leases name it. Answers its name if it is not any more.
local function need(digest, times)
  if redis.call('HINCRBY', '{BLOB_REFERENCES}', digest, times) > 0 then return nil end
  local name = blob_name(digest)
  redis.call('ZADD', '{DOOMED_BLOBS}', 0, name)
  redis.call('HDEL', '{BLOB_REFERENCES}', digest)
  redis.call('HDEL', '{BLOB_GENERATIONS}', digest)
  return name
end
"""
)

LEASE = (
    NEED
    + f"""
-- ARGV: seconds, holder, a new generation, then digests
local time = redis.call('TIME')
for index = 4, #ARGV do
  local digest = ARGV[index]
  if not is_needed(digest) then
    redis.call('HSET', '{BLOB_GENERATIONS}', digest, ARGV[3])
  end
  local lease = digest .. '/' .. ARGV[2]
  if not redis.call('ZSCORE', '{BLOB_LEASES}', lease) then need(digest, 1) end
  redis.call('ZADD', '{BLOB_LEASES}', 'GT', time[1] + ARGV[1], lease)
end
"""
)

LEASE_WHEN_FULL = WHEN_FULL + LEASE

END_LEASES = (
    WHEN_FULL
    + NEED
    + f"""
-- ARGV: how many leases to look at, seconds. Ends those that have run out; those of a batch go on
-- for so many seconds while some of its jobs have still to be entered, as these hold no file yet.
local time = redis.call('TIME')
local over = redis.call('ZRANGEBYSCORE', '{BLOB_LEASES}', '-inf', time[1], 'LIMIT', 0, ARGV[1])
for _, lease in ipairs(over) do
  local digest, holder = string.match(lease, '^([^/]*)/(.*)$')
  if redis.call('EXISTS', 'meshcone:batch:' .. holder .. ':entry') == 1 then
    redis.call('ZADD', '{BLOB_LEASES}', time[1] + ARGV[2], lease)
  else
    redis.call('ZREM', '{BLOB_LEASES}', lease)
    need(digest, -1)
  end
end
return #over
"""
)

NAMES_OF = (
    _NAME
    + """
-- ARGV: digests. Answers the blobs' names, '' for one that nobody needs.
local names = {}
for index, digest in ipairs(ARGV) do
  names[index] = is_needed(digest) and blob_name(digest) or ''
end
return names
"""
)

IS_HAD = f"""
-- KEYS[1]: the files of a project's jobs. ARGV: digest, holder of what the project has uploaded.
-- Answers whether the project has the file.
if redis.call('HEXISTS', KEYS[1], ARGV[1]) == 1 then return 1 end
local ends = redis.call('ZSCORE', '{BLOB_LEASES}', ARGV[1] .. '/' .. ARGV[2])
return ends and tonumber(ends) > tonumber(redis.call('TIME')[1]) and 1 or 0
"""

SET_ASIDE = (
    _NAME
    + f"""
-- ARGV: digest, name, a new generation, seconds. Gives a blob that has this name another,
-- and removes what is under the old one after so many seconds. Answers whether it had it.
if not is_needed(ARGV[1]) or blob_name(ARGV[1]) ~= ARGV[2] then return 0 end
redis.call('HSET', '{BLOB_GENERATIONS}', ARGV[1], ARGV[3])
redis.call('ZADD', '{DOOMED_BLOBS}', redis.call('TIME')[1] + ARGV[4], ARGV[2])
return 1
"""
)

TAKE_DOOMED = f"""{WHEN_FULL}
-- ARGV: how many, seconds. Answers names that nobody is removing; they are the caller's to
-- remove for so many seconds.
local time = redis.call('TIME')
local taken = redis.call('ZRANGEBYSCORE', '{DOOMED_BLOBS}', '-inf', time[1], 'LIMIT', 0, ARGV[1])
for _, name in ipairs(taken) do
  redis.call('ZADD', '{DOOMED_BLOBS}', time[1] + ARGV[2], name)
end
return taken
"""
