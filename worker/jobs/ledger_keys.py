"""Where the ledger's data are in the broker.

    meshcone:job:ID             hash: the record, a field each
    meshcone:job:ID:events      stream: what happened to it, capped
    meshcone:job:ID:blobs       set: digests of the files it holds on to
    meshcone:index:…            sorted sets of ids, all of score 0: ids sort by creation time
    meshcone:since:STATE        sorted set of ids by the time, in seconds, they entered the state;
                                an expired job is under `expired` instead of its state
    meshcone:counters           hash: what has happened since the ledger was begun
    meshcone:webhooks           stream: webhooks to be sent; see worker.jobs.outbox
    meshcone:fetches            sorted set: queued jobs some of whose files are still to be fetched,
                                by the time at which that is to be tried; see worker.transfers
    meshcone:fetches:tries      hash: how often it was tried, by the job's id
    meshcone:outputs            sorted set: results to be put somewhere, as ID/artifact, by the
                                time at which that is to be tried; see worker.transfers
    meshcone:outputs:tries      hash: how often it was tried
    meshcone:blobs:…            see worker.storage.register
    meshcone:idempotency:HASH   see worker.jobs.idempotency

The scripts build some of these names themselves, so a cluster of brokers is not possible.
"""

from __future__ import annotations

ALL_JOBS = "meshcone:index:all"
COUNTERS = "meshcone:counters"
WEBHOOKS = "meshcone:webhooks"
FETCHES = "meshcone:fetches"
DELIVERIES = "meshcone:outputs"
DELIVERY_TRIES = "meshcone:outputs:tries"
FETCH_TRIES = "meshcone:fetches:tries"
BLOB_REFERENCES = "meshcone:blobs:references"
BLOB_LEASES = "meshcone:blobs:leases"
BLOB_GENERATIONS = "meshcone:blobs:generations"
DOOMED_BLOBS = "meshcone:blobs:doomed"


def job_keys(job_id: str) -> tuple[str, str, str]:
    """Hash, events and blobs of a job."""
    key = f"meshcone:job:{job_id}"
    return key, f"{key}:events", f"{key}:blobs"


def index_of(kind: str, value: str) -> str:
    """The index of the jobs whose state, label or verdict has a value."""
    return f"meshcone:index:{kind}:{value}"


def since(state: str) -> str:
    """The jobs of a state, by the time they entered it."""
    return f"meshcone:since:{state}"
