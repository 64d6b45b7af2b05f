"""How the broker divides jobs and files by project.

A project has indexes, times and counters of its own, under names that begin with
``meshcone:project:NAME:``. They are written by the same steps as those of all jobs.
"""

from __future__ import annotations

from worker.jobs.identifiers import DEFAULT_PROJECT
from worker.jobs.ledger_keys import PROJECTS, all_jobs
from worker.jobs.records import FINAL_STATES

_STATES = ", ".join(f"'{state}'" for state in ("queued", "running", *FINAL_STATES))

PROJECT = f"""
local function project_of(job)
  return cjson.decode(redis.call('HGET', job, 'project') or '"{DEFAULT_PROJECT}"')
end

-- The API key that has sent a job; '' where it came without.
local function owner_of(job)
  local owner = redis.call('HGET', job, 'owner')
  return owner and owner ~= 'null' and cjson.decode(owner) or ''
end

local function place_of(job) return 'meshcone:project:' .. project_of(job) .. ':' end

-- The key of the batch that a job belongs to; nil if it was sent by itself.
local function batch_of(job)
  local batch = redis.call('HGET', job, 'batch')
  return batch and batch ~= 'null' and 'meshcone:batch:' .. cjson.decode(batch) or nil
end

-- A project has a file as long as jobs of it have, or somebody's lease on its upload lasts.
local function own(job, digest, times)
  local files = place_of(job) .. 'blobs'
  if redis.call('HINCRBY', files, digest, times) <= 0 then redis.call('HDEL', files, digest) end
end

-- How many jobs of a key are queued decides whether further ones are let in.
local function count_queued(id, state)
  local job = 'meshcone:job:' .. id
  local place, owner = place_of(job), owner_of(job)
  if state == 'queued' then
    redis.call('SADD', place .. 'owners', owner)
    redis.call('SADD', place .. 'queued:' .. owner, id)
  else
    redis.call('SREM', place .. 'queued:' .. owner, id)
  end
end

local function place_in(to, id)
  local job = 'meshcone:job:' .. id
  redis.call('ZADD', to .. 'index:all', 0, id)
  for _, label in ipairs(cjson.decode(redis.call('HGET', job, 'labels') or '[]')) do
    redis.call('ZADD', to .. 'index:label:' .. label, 0, id)
  end
  local verdict = redis.call('HGET', job, 'verdict')
  if verdict and verdict ~= 'null' then
    redis.call('ZADD', to .. 'index:verdict:' .. cjson.decode(verdict), 0, id)
  end
  local state = redis.call('HGET', job, 'state')
  for _, other in ipairs({{{_STATES}}}) do
    if other == state then
      redis.call('ZADD', to .. 'index:state:' .. state, 0, id)
    else
      redis.call('ZREM', to .. 'index:state:' .. other, id)
    end
  end
  for _, each in ipairs({{{_STATES}, 'expired'}}) do
    local since = redis.call('ZSCORE', 'meshcone:since:' .. each, id)
    if since then
      redis.call('ZADD', to .. 'since:' .. each, since, id)
    else
      redis.call('ZREM', to .. 'since:' .. each, id)
    end
  end
end

-- Puts a job where its project and its batch find it, whatever version has made or moved it.
-- Answers whether a version has made it that had no such places.
local function find_a_place(id)
  local job = 'meshcone:job:' .. id
  local state = redis.call('HGET', job, 'state')
  if not state then return false end
  local is_new = redis.call('HSETNX', job, 'project', '"{DEFAULT_PROJECT}"') == 1
  if is_new then
    for _, digest in ipairs(redis.call('SMEMBERS', job .. ':blobs')) do own(job, digest, 1) end
  end
  redis.call('SADD', '{PROJECTS}', project_of(job))
  count_queued(id, state)
  place_in(place_of(job), id)
  local batch = batch_of(job)
  if batch then
    place_in(batch .. ':', id)
    return is_new
  end
  local was_alone = redis.call('ZSCORE', 'meshcone:alone:index:all', id)
  place_in('meshcone:alone:', id)
  place_in(place_of(job) .. 'alone:', id)
  return is_new or not was_alone
end
"""
"""Lua: whose a job is, ``count_queued`` and ``find_a_place``, for the ledger's scripts."""

PLACE = (
    PROJECT
    + f"""
-- KEYS[1]: how far the last look has come. ARGV[1]: how many jobs to look at. Answers whether a
-- version without these places has made one of them; begins anew when all have been looked at.
local from = redis.call('GET', KEYS[1])
local ids = redis.call('ZRANGEBYLEX', '{all_jobs()}', from and '(' .. from or '-', '+',
                       'LIMIT', 0, ARGV[1])
local found = 0
for _, id in ipairs(ids) do
  if find_a_place(id) then found = 1 end
end
if #ids < tonumber(ARGV[1]) then
  redis.call('DEL', KEYS[1])
else
  redis.call('SET', KEYS[1], ids[#ids])
end
return found
"""
)
