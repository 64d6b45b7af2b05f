"""The outbox: webhooks to be sent, written whole by the ledger step that ends their job.

An entry needs nothing of its job any more: it is sent even if the job is deleted a moment
later. :mod:`worker.webhooks` takes entries out and sends them.
"""

from __future__ import annotations

import json
from datetime import UTC, datetime
from typing import Any, Self

from pydantic import BaseModel, ConfigDict

from worker.jobs import ledger_keys as keys
from worker.jobs.records import FINAL_STATES

KEPT = 20_000
"""Entries kept while nobody takes them out; usually half a kilobyte each, so 10 MB. When one more
comes, the oldest falls out and is counted."""

DROPPED = "webhooks:dropped"
"""The ledger's counter of webhooks that fell out or could not be read."""

_TOLD = ", ".join(f"{state}=true" for state in FINAL_STATES)

WRITE = f"""
local told = {{{_TOLD}}}

-- A version that knows nothing of `message` reads the other fields, and the job.
local function write_message(of, id, state, attempt, is_batch)
  local url = redis.call('HGET', of, 'webhook')
  if not url or url == 'null' then return end
  local message = cjson.encode({{
    id=id .. '_' .. state .. '_' .. attempt, job=id, state=state, attempt=attempt, batch=is_batch,
    url=cjson.decode(url), owner=cjson.decode(redis.call('HGET', of, 'owner') or 'null'),
    labels=redis.call('HGET', of, 'labels') or '[]', milliseconds=math.floor(1000 * now())}})
  redis.call('XADD', '{keys.WEBHOOKS}', '*',
             'job', id, 'state', state, 'attempt', attempt, 'message', message)
  local lost = redis.call('XTRIM', '{keys.WEBHOOKS}', 'MAXLEN', {KEPT})
  if lost > 0 then redis.call('HINCRBY', '{keys.COUNTERS}', '{DROPPED}', lost) end
end

local function write_webhook(state, attempt)
  if told[state] then write_message(job, step.id, state, attempt, false) end
end
"""
"""Lua: ``write_webhook(state, attempt)`` and ``write_message``, for the ledger's scripts."""


class Message(BaseModel):
    """The end of a job, or of a batch, to be told.

    It says little on purpose: the receiver asks the API for the rest, with a key of its own.

    Attributes:
        id: the same however often it is sent, so that a receiver knows what it has had.
        url: where to.
        job: the id of the job, or of the batch.
        batch: whether it is one.
        owner: the API key whose secret signs it; None for the installation's.
        at: when the job ended.
    """

    model_config = ConfigDict(frozen=True)

    id: str
    job: str
    state: str
    attempt: int
    url: str
    owner: str | None
    labels: tuple[str, ...]
    at: datetime
    batch: bool = False

    @classmethod
    def decoded(cls, text: str) -> Self:
        """The message that the ledger's step has written.

        Raises:
            ValueError: it is none.
        """
        found = json.loads(text)
        if not isinstance(found, dict):
            raise ValueError("a message is a JSON object")
        try:
            fields: dict[str, Any] = {
                "owner": None,
                **found,
                "labels": tuple(json.loads(found["labels"])),
                "at": datetime.fromtimestamp(found["milliseconds"] / 1000, UTC),
            }
        except (KeyError, TypeError, OverflowError, OSError) as error:
            raise ValueError(f"a message is not complete: {error!r}") from None
        return cls(**fields)

    def body(self) -> bytes:
        """The payload, in the form the Standard Webhooks specification recommends."""
        how: dict[str, Any] = {}
        if not self.batch:  # that one has finished says nothing of how its jobs have ended
            how = {"state": self.state, "attempt": self.attempt}
        kind, path = ("batch", "batches") if self.batch else ("job", "jobs")
        data = {"id": self.job, **how, "labels": self.labels, "path": f"/v1/{path}/{self.job}"}
        document = {
            "type": f"{kind}.{self.state}",
            "timestamp": self.at.isoformat(),
            "data": data,
        }
        return json.dumps(document, separators=(",", ":")).encode()
