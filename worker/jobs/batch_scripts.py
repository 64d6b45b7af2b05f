"""The atomic steps of a batch; see :mod:`worker.jobs.batches`."""

from __future__ import annotations

from worker.jobs import ledger_keys as keys
from worker.jobs.full_broker import WHEN_FULL
from worker.jobs.lines import ROOM
from worker.jobs.step_scripts import (
    ACCEPTED,
    CANCEL_JOB,
    ENTER_JOB,
    FULL,
    MISMATCHED,
    PRELUDE,
    REFUSED,
    REPEATED,
)

COMMIT = (
    ROOM
    + f"""
-- KEYS: batch, its entry, its project's batches, and the key where the sender has given the request
-- one. ARGV[1]: id, fields, pairs, capacity, project, owner; fingerprint and remembered of a key.
-- Answers {{answer, id of the batch that the key is of}}.
local batch, entry, key = KEYS[1], KEYS[2], KEYS[4]
local step = cjson.decode(ARGV[1])
if key then
  local known = redis.call('HGET', key, 'job')
  if known then
    local is_same = redis.call('HGET', key, 'fingerprint') == step.fingerprint
    return {{is_same and {REPEATED} or {MISMATCHED}, known}}
  end
end
if redis.call('EXISTS', batch) == 1 or redis.call('LLEN', entry) ~= step.pairs then
  return {{{REFUSED}, step.id}}
end
if not has_room(step.capacity, step.project, step.owner, step.pairs) then
  return {{{FULL}, step.id}}
end
redis.call('PERSIST', entry)
for name, value in pairs(step.fields) do redis.call('HSET', batch, name, value) end
redis.call('ZADD', '{keys.BATCHES}', 0, step.id)
redis.call('ZADD', KEYS[3], 0, step.id)
redis.call('SADD', '{keys.OPEN_BATCHES}', step.id)
if key then
  redis.call('HSET', key, 'job', step.id, 'fingerprint', step.fingerprint)
  redis.call('EXPIRE', key, step.remembered)
end
return {{{ACCEPTED}, step.id}}
"""
)

CARRY_ON = (
    PRELUDE
    + ENTER_JOB
    + CANCEL_JOB
    + """
-- KEYS: batch, its entry, its queued jobs, its running ones. step: id, finished, count. Enters, or
-- cancels, some more of its jobs; those that run are asked to stop, at each step, as one may have
-- begun since the last. Answers the ids of those that can be run, and whether anything is left to
-- be done.
local batch, entry, waiting, running = KEYS[1], KEYS[2], KEYS[3], KEYS[4]
local batch_id, count, finished = step.id, step.count, step.finished
local ready = {}

local function take_up(id, taken)
  job, step = 'meshcone:job:' .. id, taken
  events, blobs = job .. ':events', job .. ':blobs'
end

local function cancel_all(ids)
  for _, id in ipairs(ids) do
    take_up(id, {id=id, finished=finished})
    cancel_job()
  end
end

if redis.call('EXISTS', batch) == 0 then return {ready, 0} end
if redis.call('HEXISTS', batch, 'cancel_requested') == 1 then
  local left = redis.call('LLEN', entry)
  if left > 0 then redis.call('HINCRBY', batch, 'dropped', left) end
  redis.call('DEL', entry)
  cancel_all(redis.call('ZRANGE', waiting, 0, count - 1))
  cancel_all(redis.call('ZRANGE', running, 0, -1))
else
  local accounts = cjson.decode(redis.call('HGET', batch, 'accounts') or '[]')
  for _, document in ipairs(redis.call('LPOP', entry, count) or {}) do
    local taken = cjson.decode(document)
    take_up(taken.id, taken)
    if redis.call('EXISTS', job) == 0 then
      enter_job()
      if not taken.incomplete then ready[#ready + 1] = taken.id end
      for _, account in ipairs(accounts) do
        redis.call('ZADD', account, math.floor(now()), taken.id)
      end
    end
  end
end
end_batch(batch)
local is_canceled = redis.call('HEXISTS', batch, 'cancel_requested') == 1
local more = redis.call('EXISTS', entry, is_canceled and waiting or entry) > 0
return {ready, more and 1 or 0}
"""
)

CANCEL_ON = WHEN_FULL + CARRY_ON
"""The same, for a batch that is canceled: none of its jobs are entered any more."""

REQUEST_CANCEL = (
    WHEN_FULL
    + """
-- KEYS: batch. ARGV[1]: now. Answers whether there is such a batch that has not ended.
if redis.call('EXISTS', KEYS[1]) == 0 or redis.call('HEXISTS', KEYS[1], 'finished') == 1 then
  return 0
end
redis.call('HSETNX', KEYS[1], 'cancel_requested', ARGV[1])
return 1
"""
)

FORGET = (
    WHEN_FULL
    + PRELUDE
    + f"""
-- KEYS: batch, its jobs. Forgets a batch that has ended and has no jobs any more.
if redis.call('HEXISTS', KEYS[1], 'finished') == 0 or redis.call('EXISTS', KEYS[2]) == 1 then
  return {REFUSED}
end
forget_batch(KEYS[1])
return {ACCEPTED}
"""
)
