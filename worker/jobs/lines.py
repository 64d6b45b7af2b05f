"""Lines: where jobs wait for their turn, one for each API key.

Projects have their turns one after another, and so have the keys of a project. A job waits in the
line of its key, first in, first out. So whoever has sent thousands of jobs delays those of others
by no more than what is released ahead of workers.

Jobs that can run are released into RQ's one queue, so far that it is never longer than
:data:`WINDOW`. Jobs whose files are still to be fetched wait in lines of the same kind for whoever
fetches them. A line is no promise: the ledger says which jobs are queued, and one that has fallen
out of its line is put into it again by the reconciler.
"""

from __future__ import annotations

from worker.jobs.full_broker import WHEN_FULL
from worker.jobs.identifiers import DEFAULT_PROJECT
from worker.jobs.ledger_keys import (
    FETCH_LINES,
    FETCH_TRIES,
    FETCHES,
    OPEN_BATCHES,
    PROJECTS,
    QUEUE_LINES,
    TURN,
)
from worker.jobs.project_scripts import PROJECT

WINDOW = 8
"""Jobs released ahead of the workers: each worker that takes one up has the next released. More
would let a key that is alone for a moment stand before those who come then."""

FETCHES_LOOKED_AT = 200
"""Due jobs among which those are looked for whose project may have one more fetched."""

LINES = f"""
local function places_in(lines, id)
  local job = 'meshcone:job:' .. id
  local project, owner = project_of(job), owner_of(job)
  local keys = lines .. ':' .. project
  return project, owner, keys, keys .. ':' .. owner
end

local function turn() return redis.call('INCR', '{TURN}') end

-- What was begun before goes before what was not.
local function wait_in(lines, id, was_begun)
  local project, owner, keys, line = places_in(lines, id)
  redis.call('ZADD', line, 'NX', was_begun and 0 or turn(), id)
  redis.call('ZADD', keys, 'NX', turn(), owner)
  redis.call('ZADD', lines, 'NX', turn(), project)
end

local function leave_lines(lines, id)
  local _, _, _, line = places_in(lines, id)
  redis.call('ZREM', line, id)
end

-- Puts the first at the end, or out where nothing waits there any more.
local function turn_over(places, name, waits)
  if waits then
    redis.call('ZADD', places, turn(), name)
  else
    redis.call('ZREM', places, name)
  end
end

-- Takes out the job whose turn it is; nil where none waits. Of projects in `full` none is taken.
local function next_in(lines, full)
  for _, project in ipairs(redis.call('ZRANGE', lines, 0, -1)) do
    local keys = lines .. ':' .. project
    while not (full and full[project]) do
      local owner = redis.call('ZRANGE', keys, 0, 0)[1]
      if not owner then
        redis.call('ZREM', lines, project)
        break
      end
      local line = keys .. ':' .. owner
      local id = redis.call('ZPOPMIN', line)[1]
      turn_over(keys, owner, redis.call('EXISTS', line) == 1)
      turn_over(lines, project, redis.call('EXISTS', keys) == 1)
      if id then return id end
    end
  end
end
"""
"""Lua: ``wait_in``, ``leave_lines`` and ``next_in``, after that of projects."""

ROOM = f"""
-- The jobs of batches that are accepted and not entered yet: of all, of a project, of a key.
local function not_entered(project, owner)
  local sum, of_project, of_key = 0, 0, 0
  for _, id in ipairs(redis.call('SMEMBERS', '{OPEN_BATCHES}')) do
    local batch = 'meshcone:batch:' .. id
    local left = redis.call('LLEN', batch .. ':entry')
    if left > 0 and redis.call('HEXISTS', batch, 'cancel_requested') == 0 then
      sum = sum + left
      local whose = redis.call('HMGET', batch, 'project', 'owner')
      if cjson.decode(whose[1] or '"{DEFAULT_PROJECT}"') == project then
        of_project = of_project + left
        if (whose[2] and cjson.decode(whose[2]) or '') == owner then of_key = of_key + left end
      end
    end
  end
  return sum, of_project, of_key
end

-- Whether so many more jobs of a sender may be queued: below the capacity, or below the share of it
-- that each project with queued jobs has, or each key of the project. So nobody who has little
-- queued is kept out by those who have much.
local function has_room(capacity, project, owner, more)
  local coming, coming_of_project, coming_of_key = not_entered(project, owner)
  local function queued(place) return redis.call('ZCARD', place .. 'since:queued') end
  local function with_own(names, own, place)
    local count = 1
    for _, name in ipairs(names) do
      if name ~= own and redis.call('EXISTS', place(name)) == 1 then count = count + 1 end
    end
    return count
  end
  if queued('meshcone:') + coming + more <= capacity then return true end
  local projects = redis.call('SMEMBERS', '{PROJECTS}')
  local share = capacity / with_own(projects, project, function(name)
    return 'meshcone:project:' .. name .. ':since:queued'
  end)
  local own = 'meshcone:project:' .. project .. ':'
  if queued(own) + coming_of_project + more <= share then return true end
  local function of_key(name) return own .. 'queued:' .. name end
  share = share / with_own(redis.call('SMEMBERS', own .. 'owners'), owner, of_key)
  return redis.call('SCARD', of_key(owner)) + coming_of_key + more <= share
end
"""
"""Lua: ``has_room(capacity, project, owner, more)``; jobs count from their batch's commit on."""

HAS_ROOM = (
    ROOM
    + """
-- ARGV: capacity, project, owner, jobs
return has_room(tonumber(ARGV[1]), ARGV[2], ARGV[3], tonumber(ARGV[4])) and 1 or 0
"""
)

_QUEUED = """
local function is_queued(id)
  return redis.call('HGET', 'meshcone:job:' .. id, 'state') == 'queued'
end
"""

LINE_UP = (
    WHEN_FULL
    + PROJECT
    + LINES
    + _QUEUED
    + f"""
-- ARGV: ids of jobs. Those that are queued, and have all their files, wait for their turn.
for _, id in ipairs(ARGV) do
  if is_queued(id) and not redis.call('ZSCORE', '{FETCHES}', id) then
    local attempt = tonumber(redis.call('HGET', 'meshcone:job:' .. id, 'attempt') or 0)
    wait_in('{QUEUE_LINES}', id, attempt > 0)
  end
end
"""
)

RELEASE = (
    WHEN_FULL
    + PROJECT
    + LINES
    + _QUEUED
    + f"""
-- KEYS: RQ's queue, its set of queues. ARGV: length of the queue at most; what names the messages
-- of this call and of no other; the fields of a message, in which @job stands for the job's id;
-- what the key of a message begins with.
local fields = cjson.decode(ARGV[3])
for number = redis.call('LLEN', KEYS[1]) + 1, tonumber(ARGV[1]) do
  local id
  repeat id = next_in('{QUEUE_LINES}') until not id or is_queued(id)
  if not id then break end
  local message, written = id .. '_' .. ARGV[2] .. number, {{}}
  for name, value in pairs(fields) do
    written[#written + 1] = name
    written[#written + 1] = string.gsub(tostring(value), '@job', id)
  end
  redis.call('HSET', ARGV[4] .. message, unpack(written))
  redis.call('SADD', KEYS[2], KEYS[1])
  redis.call('RPUSH', KEYS[1], message)
end
"""
)

LINED_UP = f"""
-- Answers the ids of the jobs that wait for their turn to run.
local found = {{}}
for _, project in ipairs(redis.call('ZRANGE', '{QUEUE_LINES}', 0, -1)) do
  local keys = '{QUEUE_LINES}:' .. project
  for _, owner in ipairs(redis.call('ZRANGE', keys, 0, -1)) do
    for _, id in ipairs(redis.call('ZRANGE', keys .. ':' .. owner, 0, -1)) do
      found[#found + 1] = id
    end
  end
end
return found
"""

TAKE_FETCHES = (
    PROJECT
    + LINES
    + f"""
-- ARGV: how many; seconds they are taken for; how many jobs of a project the caller may have in
-- hand, and how many it has, by project. Answers incomplete jobs, each with how often it has been
-- taken and its project: in turn those whose first try it is, and those that are due again.
local time = redis.call('TIME')
local now = tonumber(time[1]) + tonumber(time[2]) / 1e6
local most, in_hand = tonumber(ARGV[3]), cjson.decode(ARGV[4])
local taken, full = {{}}, {{}}

local function count(project, more)
  in_hand[project] = (in_hand[project] or 0) + more
  full[project] = in_hand[project] >= most
end
for project in pairs(in_hand) do count(project, 0) end

local function take(id, project)
  count(project, 1)
  redis.call('ZADD', '{FETCHES}', string.format('%.6f', now + tonumber(ARGV[2])), id)
  taken[#taken + 1] = {{id, redis.call('HINCRBY', '{FETCH_TRIES}', id, 1), project}}
  return true
end

local function take_first()
  local id
  repeat id = next_in('{FETCH_LINES}', full)
  until not id or redis.call('ZSCORE', '{FETCHES}', id)
  return id and take(id, project_of('meshcone:job:' .. id))
end

local due = redis.call('ZRANGEBYSCORE', '{FETCHES}', '-inf', string.format('%.6f', now),
                       'LIMIT', 0, {FETCHES_LOOKED_AT})
local seen = 0
local function take_again()
  while seen < #due do
    seen = seen + 1
    local project = project_of('meshcone:job:' .. due[seen])
    if not full[project] then return take(due[seen], project) end
  end
end

local takers = {{take_first, take_again}}
local count_left, idle = tonumber(ARGV[1]), 0
while count_left > 0 and idle < 2 do
  takers[1], takers[2] = takers[2], takers[1]
  if takers[1]() then
    count_left, idle = count_left - 1, 0
  else
    idle = idle + 1
  end
end
return taken
"""
)
