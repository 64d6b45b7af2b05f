"""What the ledger says became of a job."""

from __future__ import annotations

import json

from redis import Redis

from worker.jobs.ledger_keys import job_keys


def times_succeeded(connection: Redis, job_id: str) -> int:
    """How often a job has succeeded: its events are written by transitions alone."""
    _, events, _ = job_keys(job_id)
    states = [
        json.loads(fields["data"])["state"]
        for _, fields in connection.xrange(events)
        if fields["event"] == "state"
    ]
    return states.count("succeeded")
