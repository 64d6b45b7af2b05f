"""The ledger's atomic steps, as they run inside the broker.

In each, KEYS are the job's hash, its events and its blobs, and ARGV[1] is a JSON object. A
step answers {answer, state, attempt}, as found if it is refused; an unknown job has the
state ''. What follows from a step (events, webhooks, counters, indexes, references to
blobs) is written by the same script, and nowhere else.
"""

from __future__ import annotations

from worker.jobs import ledger_keys as keys
from worker.jobs import outbox
from worker.jobs.blob_scripts import NEED
from worker.jobs.lines import LINES, ROOM
from worker.jobs.project_scripts import PROJECT
from worker.jobs.records import FILE_FIELDS

EVENTS_KEPT = 256
"""Events kept of a job; what falls out can be read from the job itself."""

_WITH_URLS = ", ".join(f"'{field}'" for field in (*FILE_FIELDS, "outputs"))

REFUSED, ACCEPTED, REPEATED, MISMATCHED, FULL, CANCEL_REQUESTED, TOO_NEW = range(7)

_PRELUDE = f"""
local job, events, blobs = KEYS[1], KEYS[2], KEYS[3]
local step = cjson.decode(ARGV[1])

local function now()
  local time = redis.call('TIME')
  return tonumber(time[1]) + tonumber(time[2]) / 1e6
end

local function found()
  return redis.call('HGET', job, 'state') or '', tonumber(redis.call('HGET', job, 'attempt') or 0)
end

local function note(event, data)
  redis.call('XADD', events, 'MAXLEN', {EVENTS_KEPT}, '*', 'event', event, 'data', data)
end

local function set(fields)
  for name, value in pairs(fields) do redis.call('HSET', job, name, value) end
end

-- Whether some of its files are still to be fetched: then nobody may begin it.
local function is_incomplete()
  return redis.call('ZSCORE', '{keys.FETCHES}', step.id) ~= false
end

local function end_fetching()
  redis.call('ZREM', '{keys.FETCHES}', step.id)
  redis.call('HDEL', '{keys.FETCH_TRIES}', step.id)
end

{PROJECT}
{LINES}
-- Of a job that a version without projects has made.
if redis.call('EXISTS', job) == 1 and redis.call('HEXISTS', job, 'project') == 0 then
  find_a_place(step.id)
end

-- Everything is counted and found twice: among all jobs, and among those of the project.
local function each_place(act)
  act('meshcone:')
  act(place_of(job))
end

local function tally(name, amount)
  each_place(function(place) redis.call('HINCRBYFLOAT', place .. 'counters', name, amount) end)
end

-- A job is counted and found under one state, and holds the time it entered it.
local function move(old, new)
  local time = now()
  if old == 'queued' then
    end_fetching()
    leave_lines('{keys.QUEUE_LINES}', step.id)
    leave_lines('{keys.FETCH_LINES}', step.id)
  end
  count_queued(step.id, new)
  local since = old ~= '' and redis.call('ZSCORE', 'meshcone:since:' .. old, step.id)
  if since then tally('seconds:' .. old, time - tonumber(since)) end
  tally('transitions:' .. old .. ':' .. new, 1)
  each_place(function(place)
    redis.call('ZREM', place .. 'since:' .. old, step.id)
    redis.call('ZREM', place .. 'index:state:' .. old, step.id)
    redis.call('ZADD', place .. 'since:' .. new, string.format('%.6f', time), step.id)
    redis.call('ZADD', place .. 'index:state:' .. new, 0, step.id)
  end)
end
{outbox.WRITE}
-- What is to be put somewhere is due from the step on that has made it.
local function write_outputs(state)
  local outputs = state == 'succeeded' and redis.call('HGET', job, 'outputs')
  if not outputs then return end
  for name in pairs(cjson.decode(outputs)) do
    redis.call('ZADD', '{keys.DELIVERIES}', string.format('%.6f', now()), step.id .. '/' .. name)
  end
end

local function without_queries(value)
  for name, each in pairs(value) do
    if name == 'url' then value[name] = string.gsub(each, '%?.*', '')
    elseif type(each) == 'table' then without_queries(each) end
  end
  return value
end

-- The query of a URL may be a secret, and of such a job nothing more is fetched or put.
local function forget_queries()
  for _, field in ipairs({{{_WITH_URLS}}}) do
    local value = redis.call('HGET', job, field)
    -- What has one is no empty list, which would be written as an object.
    if value and string.find(value, '?', 1, true) then
      set({{[field]=cjson.encode(without_queries(cjson.decode(value)))}})
    end
  end
end

local function announce(state, attempt)
  if state == 'failed' or state == 'canceled' then forget_queries() end
  note('state', cjson.encode({{state=state, attempt=attempt}}))
  write_webhook(state, attempt)
  write_outputs(state)
end

{NEED}
local function end_lease(digest)
  if redis.call('ZREM', '{keys.BLOB_LEASES}', digest .. '/' .. step.id) == 1 then
    need(digest, -1)
  end
end

local function hold(digests)
  for _, digest in ipairs(digests) do
    if redis.call('SADD', blobs, digest) == 1 then
      need(digest, 1)
      own(job, digest, 1)
    end
    end_lease(digest)
  end
end

-- Answers the names of the files that nobody needs any more.
local function let_go()
  local doomed = {{}}
  for _, digest in ipairs(redis.call('SMEMBERS', blobs)) do
    own(job, digest, -1)
    doomed[#doomed + 1] = need(digest, -1)
  end
  redis.call('DEL', blobs)
  return doomed
end

local function count(counters)
  for name, amount in pairs(counters) do tally(name, amount) end
end
"""

CREATE = (
    _PRELUDE
    + ROOM
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
set(step.fields)
hold(step.digests)
redis.call('SADD', '{keys.PROJECTS}', project_of(job))
each_place(function(place)
  redis.call('ZADD', place .. 'index:all', 0, step.id)
  for _, label in ipairs(step.labels) do
    redis.call('ZADD', place .. 'index:label:' .. label, 0, step.id)
  end
end)
if key then
  redis.call('HSET', key, 'job', step.id, 'fingerprint', step.fingerprint)
  redis.call('EXPIRE', key, step.remembered)
end
move('', 'queued')
if step.incomplete then
  redis.call('ZADD', '{keys.FETCHES}', '+inf', step.id)
  wait_in('{keys.FETCH_LINES}', step.id)
end
announce('queued', 0)
return {{{ACCEPTED}, 'queued', 0}}
"""
)

TRANSITION = (
    _PRELUDE
    + f"""
-- step: id, from, to, starts (added to the attempt), finished; attempt, where one must be
-- meant; incomplete, whether files must be missing, where that counts; knows, the highest version
-- of options the worker can read, where that counts; and fields, digests, counters, verdict,
-- which the step leaves
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
    _PRELUDE
    + f"""
-- step: id, fields (its files among them), digests
local state, attempt = found()
if state ~= 'queued' or not is_incomplete() then return {{{REFUSED}, state, attempt}} end
set(step.fields)
hold(step.digests)
end_fetching()
return {{{ACCEPTED}, state, attempt}}
"""
)

NOTE_OUTPUT = (
    _PRELUDE
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
    _PRELUDE
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
    _PRELUDE
    + f"""
-- step: id, finished
local state, attempt = found()
if state == 'queued' then
  set({{state='canceled', finished=step.finished, progress='null'}})
  move(state, 'canceled')
  announce('canceled', attempt)
  return {{{ACCEPTED}, 'canceled', attempt}}
end
if state == 'running' then
  if redis.call('HSETNX', job, 'cancel_requested', step.finished) == 1 then
    note('cancel', cjson.encode({{attempt=attempt}}))
  end
  return {{{ACCEPTED}, state, attempt}}
end
return {{state == 'canceled' and {ACCEPTED} or {REFUSED}, state, attempt}}
"""
)

EXPIRE = (
    _PRELUDE
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
  let_go()
  redis.call('DEL', events)
end
return {{{ACCEPTED}, state, attempt}}
"""
)

DELETE = (
    _PRELUDE
    + f"""
-- step: id; answers the names of the files that nobody needs any more, too
local state, attempt = found()
if state == '' or state == 'queued' or state == 'running' then
  return {{{REFUSED}, state, attempt, {{}}}}
end
local doomed = let_go()
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
redis.call('DEL', job, events)
return {{{ACCEPTED}, state, attempt, doomed}}
"""
)
