"""The ledger's atomic steps, as they run inside the broker.

A step answers {answer, state, attempt}, as found if it is refused; an unknown job has the
state ''. What follows from a step (events, webhooks, counters, indexes, references to
blobs) is written by the same script, and nowhere else.
"""

from __future__ import annotations

from worker.jobs import ledger_keys as keys
from worker.jobs.full_broker import WHEN_FULL
from worker.jobs.lines import ROOM
from worker.jobs.step_scripts import (
    ACCEPTED,
    CANCEL_JOB,
    CANCEL_REQUESTED,
    ENTER_JOB,
    FULL,
    MISMATCHED,
    PRELUDE,
    REFUSED,
    REPEATED,
    TOO_NEW,
)

CREATE = (
    PRELUDE
    + ROOM
    + ENTER_JOB
    + f"""
-- step: id, fields, labels, digests, capacity, incomplete (files are still to be fetched); and
-- KEYS[4], fingerprint, remembered where the sender has given the request a key
local key = KEYS[4]
if key then
  local known = redis.call('HGET', key, 'job')
  if known then
    if redis.call('HGET', key, 'fingerprint') == step.fingerprint then
      return {{{REPEATED}, known, 0}}
    end
    return {{{MISMATCHED}, known, 0}}
  end
end
if redis.call('EXISTS', job) == 1 then return {{{REFUSED}, found()}} end
local project, owner = step.fields.project, step.fields.owner
if step.capacity and not has_room(step.capacity, cjson.decode(project),
                                  owner and cjson.decode(owner) or '', 1) then
  return {{{FULL}, 'queued', 0}}
end
enter_job()
if key then
  redis.call('HSET', key, 'job', step.id, 'fingerprint', step.fingerprint)
  redis.call('EXPIRE', key, step.remembered)
end
return {{{ACCEPTED}, 'queued', 0}}
"""
)

TRANSITION = (
    WHEN_FULL
    + PRELUDE
    + f"""
-- step: id, from, to, starts (added to the attempt), finished; attempt, where one must be
-- meant; incomplete, whether files must be missing, where that counts; knows, the highest version
-- of options the worker can read, where that counts; and fields, digests, counters, verdict,
-- judgement, which the step leaves
local state, attempt = found()
if state ~= step.from or (step.attempt and attempt ~= step.attempt)
   or (step.incomplete ~= nil and step.incomplete ~= is_incomplete()) then
  return {{{REFUSED}, state, attempt}}
end
if step.knows and tonumber(redis.call('HGET', job, 'options_version') or 0) > step.knows then
  -- In place of the attempt: whether a worker has found it so for the first time.
  return {{{TOO_NEW}, state, redis.call('HSETNX', job, 'needs_newer_worker', step.finished)}}
end
local new = step.to
-- Nobody who was told that a job will be canceled is to find it otherwise in the end.
if state == 'running' and redis.call('HEXISTS', job, 'cancel_requested') == 1 then
  new = 'canceled'
  set({{finished=step.finished, progress='null'}})
  for _, digest in ipairs(step.digests) do end_lease(digest) end
else
  set(step.fields)
  hold(step.digests)
  count(step.counters)
  if step.judgement then keep_judgement(step.judgement) end
  if step.verdict then
    each_place(function(place)
      redis.call('ZADD', place .. 'index:verdict:' .. step.verdict, 0, step.id)
    end)
  end
end
attempt = attempt + step.starts
set({{state=new, attempt=attempt}})
if step.knows then redis.call('HDEL', job, 'needs_newer_worker') end
move(state, new)
announce(new, attempt)
return {{{ACCEPTED}, new, attempt}}
"""
)

FETCHED = (
    PRELUDE
    + f"""
-- step: id, fields (its files among them), digests
local state, attempt = found()
if state ~= 'queued' or not is_incomplete() then return {{{REFUSED}, state, attempt}} end
set(step.fields)
hold(step.digests)
redis.call('HDEL', '{keys.FETCHED_BYTES}', step.id)  -- from now on it is as if it had been sent
end_fetching()
return {{{ACCEPTED}, state, attempt}}
"""
)

NOTE_OUTPUT = (
    WHEN_FULL
    + PRELUDE
    + f"""
-- step: id, name, output; outcome, if it has ended
local state, attempt = found()
local outputs = redis.call('HGET', job, 'outputs')
if state == '' or not outputs then return {{{REFUSED}, state, attempt}} end
local all = cjson.decode(outputs)
all[step.name] = step.output
set({{outputs=cjson.encode(all)}})
if step.outcome then
  local delivery = step.id .. '/' .. step.name
  if redis.call('ZREM', '{keys.DELIVERIES}', delivery) == 1 then
    tally('outputs:' .. step.outcome, 1)
  end
  redis.call('HDEL', '{keys.DELIVERY_TRIES}', delivery)
end
return {{{ACCEPTED}, state, attempt}}
"""
)

PROGRESS = (
    PRELUDE
    + f"""
-- step: id, attempt, progress
local state, attempt = found()
if state ~= 'running' or attempt ~= step.attempt then return {{{REFUSED}, state, attempt}} end
if redis.call('HEXISTS', job, 'cancel_requested') == 1 then
  return {{{CANCEL_REQUESTED}, state, attempt}}
end
set({{progress=step.progress}})
note('progress', step.progress)
return {{{ACCEPTED}, state, attempt}}
"""
)

CANCEL = (
    WHEN_FULL
    + PRELUDE
    + CANCEL_JOB
    + """
-- step: id, finished
return {cancel_job()}
"""
)

EXPIRE = (
    WHEN_FULL
    + PRELUDE
    + f"""
-- step: id, expired
local state, attempt = found()
if state == '' or state == 'queued' or state == 'running' then
  return {{{REFUSED}, state, attempt}}
end
if redis.call('HSETNX', job, 'expired', step.expired) == 1 then
  each_place(function(place)
    redis.call('ZREM', place .. 'since:' .. state, step.id)
    redis.call('ZADD', place .. 'since:expired', string.format('%.6f', now()), step.id)
  end)
  tally('expired', 1)
  keep_judgement(nil)
  let_go()
  redis.call('DEL', events)
end
return {{{ACCEPTED}, state, attempt}}
"""
)

DELETE = (
    WHEN_FULL
    + PRELUDE
    + f"""
-- step: id; answers the names of the files that nobody needs any more, too
local state, attempt = found()
if state == '' or state == 'queued' or state == 'running' then
  return {{{REFUSED}, state, attempt, {{}}}}
end
local doomed, batch = let_go(), batch_of(job)
local indexes = {{'index:all', 'index:state:' .. state, 'since:' .. state, 'since:expired'}}
for _, label in ipairs(cjson.decode(redis.call('HGET', job, 'labels') or '[]')) do
  indexes[#indexes + 1] = 'index:label:' .. label
end
local verdict = redis.call('HGET', job, 'verdict')
if verdict and verdict ~= 'null' then
  indexes[#indexes + 1] = 'index:verdict:' .. cjson.decode(verdict)
end
each_place(function(place)
  for _, index in ipairs(indexes) do redis.call('ZREM', place .. index, step.id) end
end)
tally('deleted', 1)
keep_judgement(nil)
redis.call('DEL', job, events)
-- A batch goes with the last of its jobs.
if batch and redis.call('HEXISTS', batch, 'finished') == 1
   and redis.call('EXISTS', batch .. ':index:all') == 0 then
  forget_batch(batch)
end
return {{{ACCEPTED}, state, attempt, doomed}}
"""
)
