"""The ledger's atomic steps, as they run inside the broker.

In each, KEYS[1] is the job's hash and KEYS[2] the stream of its events. A refused step
returns {0, state, attempt} as found; an unknown job has the state ''.
"""

from __future__ import annotations

EVENTS_KEPT = 256
"""Events kept of a job; what falls out can be read from the job itself."""

CREATE = f"""
-- KEYS[3]: index of all jobs. ARGV: job id, then field, value, ...
if redis.call('EXISTS', KEYS[1]) == 1 then
  return {{0, redis.call('HGET', KEYS[1], 'state'), 0}}
end
redis.call('HSET', KEYS[1], unpack(ARGV, 2))
redis.call('ZADD', KEYS[3], 0, ARGV[1])
redis.call('XADD', KEYS[2], 'MAXLEN', {EVENTS_KEPT}, '*',
           'event', 'state', 'data', cjson.encode({{state='queued', attempt=0}}))
return {{1, 'queued', 0}}
"""

TRANSITION = f"""
-- ARGV: expected state, expected attempt ('' for any), new state, increment of the attempt,
--       then field, value, ...
local state = redis.call('HGET', KEYS[1], 'state')
if not state then return {{0, '', 0}} end
local attempt = tonumber(redis.call('HGET', KEYS[1], 'attempt'))
if state ~= ARGV[1] or (ARGV[2] ~= '' and attempt ~= tonumber(ARGV[2])) then
  return {{0, state, attempt}}
end
attempt = attempt + tonumber(ARGV[4])
redis.call('HSET', KEYS[1], 'state', ARGV[3], 'attempt', attempt, unpack(ARGV, 5))
redis.call('XADD', KEYS[2], 'MAXLEN', {EVENTS_KEPT}, '*',
           'event', 'state', 'data', cjson.encode({{state=ARGV[3], attempt=attempt}}))
return {{1, ARGV[3], attempt}}
"""

PROGRESS = f"""
-- ARGV: expected attempt, progress
local state = redis.call('HGET', KEYS[1], 'state')
if not state then return {{0, '', 0}} end
local attempt = tonumber(redis.call('HGET', KEYS[1], 'attempt'))
if state ~= 'running' or attempt ~= tonumber(ARGV[1]) then return {{0, state, attempt}} end
redis.call('HSET', KEYS[1], 'progress', ARGV[2])
redis.call('XADD', KEYS[2], 'MAXLEN', {EVENTS_KEPT}, '*', 'event', 'progress', 'data', ARGV[2])
return {{1, state, attempt}}
"""
