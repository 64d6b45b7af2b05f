"""What every atomic step of the ledger is made of, as it runs inside the broker.

In each, KEYS are the job's hash, its events and its blobs, and ARGV[1] is a JSON object with the
job's id. A step of a batch has the batch's own keys there, and takes up one job after another.
"""

from __future__ import annotations

from worker.jobs import ledger_keys as keys
from worker.jobs import outbox
from worker.jobs.blob_scripts import NEED
from worker.jobs.fetch_accounts import GIVE_BACK
from worker.jobs.lines import LINES
from worker.jobs.project_scripts import PROJECT
from worker.jobs.records import FILE_FIELDS

EVENTS_KEPT = 256
"""Events kept of a job; what falls out can be read from the job itself."""

REFUSED, ACCEPTED, REPEATED, MISMATCHED, FULL, CANCEL_REQUESTED, TOO_NEW = range(7)

_WITH_URLS = ", ".join(f"'{field}'" for field in (*FILE_FIELDS, "outputs"))


_END_BATCH = f"""
-- A batch has ended when all of its jobs are entered and have ended.
local function end_batch(batch)
  if redis.call('EXISTS', batch) == 0 or redis.call('HEXISTS', batch, 'finished') == 1
     or redis.call('EXISTS', batch .. ':entry', batch .. ':since:queued',
                   batch .. ':since:running') > 0 then
    return
  end
  redis.call('HSET', batch, 'finished', string.format('%.6f', now()))
  local id = cjson.decode(redis.call('HGET', batch, 'id'))
  redis.call('SREM', '{keys.OPEN_BATCHES}', id)
  write_message(batch, id, 'finished', 0, true)
end

local function forget_batch(batch)
  local id = redis.call('HGET', batch, 'id')
  if not id then return end
  id = cjson.decode(id)
  redis.call('ZREM', '{keys.BATCHES}', id)
  redis.call('ZREM', place_of(batch) .. 'batches', id)
  redis.call('SREM', '{keys.OPEN_BATCHES}', id)
  redis.call('DEL', batch, batch .. ':counters', batch .. ':entry', batch .. ':judgements')
end
"""

PRELUDE = f"""
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

{GIVE_BACK}
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

-- Everything is counted and found in several places: among all jobs, among those of the project,
-- and among those of the batch or, where there is none, among those without.
local function each_place(act)
  local place, batch = place_of(job), batch_of(job)
  act('meshcone:')
  act(place)
  if batch then
    act(batch .. ':')
  else
    act('meshcone:alone:')
    act(place .. 'alone:')
  end
end

local function tally(name, amount)
  each_place(function(place) redis.call('HINCRBYFLOAT', place .. 'counters', name, amount) end)
end

{outbox.WRITE}
{_END_BATCH}
-- A job is counted and found under one state, and holds the time it entered it.
local function move(old, new)
  local time = now()
  if old == 'queued' then
    give_back_fetched(step.id)
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
  local batch = batch_of(job)
  if batch then end_batch(batch) end
end
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

-- What a job's report says is kept with its batch as long as the report is there.
local function keep_judgement(judgement)
  local batch = batch_of(job)
  if not batch then return end
  if judgement then
    redis.call('HSET', batch .. ':judgements', step.id, judgement)
  else
    redis.call('HDEL', batch .. ':judgements', step.id)
  end
end

local function count(counters)
  for name, amount in pairs(counters) do tally(name, amount) end
end
"""
"""Lua: what is done in several steps, and ``job``, ``events``, ``blobs`` and ``step``."""

ENTER_JOB = f"""
-- step: id, fields, labels, digests, incomplete (files are still to be fetched)
local function enter_job()
  set(step.fields)
  hold(step.digests)
  redis.call('SADD', '{keys.PROJECTS}', project_of(job))
  each_place(function(place)
    redis.call('ZADD', place .. 'index:all', 0, step.id)
    for _, label in ipairs(step.labels) do
      redis.call('ZADD', place .. 'index:label:' .. label, 0, step.id)
    end
  end)
  move('', 'queued')
  if step.incomplete then
    redis.call('ZADD', '{keys.FETCHES}', '+inf', step.id)
    wait_in('{keys.FETCH_LINES}', step.id)
  end
  announce('queued', 0)
end
"""
"""Lua: ``enter_job()``, after the prelude."""

CANCEL_JOB = f"""
-- step: id, finished
local function cancel_job()
  local state, attempt = found()
  if state == 'queued' then
    set({{state='canceled', finished=step.finished, progress='null'}})
    move(state, 'canceled')
    announce('canceled', attempt)
    return {ACCEPTED}, 'canceled', attempt
  end
  if state == 'running' then
    if redis.call('HSETNX', job, 'cancel_requested', step.finished) == 1 then
      note('cancel', cjson.encode({{attempt=attempt}}))
    end
    return {ACCEPTED}, state, attempt
  end
  return state == 'canceled' and {ACCEPTED} or {REFUSED}, state, attempt
end
"""
"""Lua: ``cancel_job()``, after the prelude; what it returns is a step's answer."""
