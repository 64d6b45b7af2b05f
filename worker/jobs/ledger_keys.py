"""Where the ledger's data are in the broker.

    meshcone:job:ID             hash: the record, a field each
    meshcone:job:ID:events      stream: what happened to it, capped
    meshcone:job:ID:blobs       set: digests of the files it holds on to
    meshcone:index:…            sorted sets of ids, all of score 0: ids sort by creation time
    meshcone:since:STATE        sorted set of ids by the time, in seconds, they entered the state;
                                an expired job is under `expired` instead of its state
    meshcone:counters           hash: what has happened since the ledger was begun
    meshcone:project:NAME:…     the same indexes, times and counters of one project's jobs alone
    meshcone:project:NAME:blobs hash: how many of the project's jobs have a file, by its digest
    meshcone:project:NAME:owners, …:queued:KEY
                                set: the API keys that have sent jobs; of each, the queued ones
    meshcone:project:NAME:batches
                                sorted set: the project's batches, as meshcone:batches
    meshcone:alone:…, meshcone:project:NAME:alone:…
                                the same of the jobs that belong to no batch
    meshcone:projects           set: the projects there are jobs of
    meshcone:projects:placed    string: how far the last look at their indexes has come
    meshcone:batch:ID           hash: a batch; see worker.jobs.batches
    meshcone:batch:ID:entry     list: its jobs that are not in the ledger yet, as JSON
    meshcone:batch:ID:judgements
                                hash: what the reports of its jobs say of gates, by the job's id
    meshcone:batch:ID:…         the same indexes, times and counters of the batch's jobs alone
    meshcone:batches            sorted set of ids, all of score 0
    meshcone:batches:open       set: ids of those that have not ended
    meshcone:lines:KIND         sorted set: the projects some of whose jobs wait in lines, by turn;
                                KIND is `queue` or `fetches`; see worker.jobs.lines
    meshcone:lines:KIND:NAME    sorted set: the keys of such a project, by turn
    meshcone:lines:KIND:NAME:KEY
                                sorted set: the jobs that wait in a key's line, by place
    meshcone:lines:turn         string: the last place or turn that was given
    meshcone:webhooks           stream: webhooks to be sent; see worker.jobs.outbox
    meshcone:fetches            sorted set: queued jobs some of whose files are still to be fetched,
                                by the time at which that is to be tried: never, as long as it has
                                not been its turn; see worker.jobs.lines and worker.transfers
    meshcone:fetches:tries      hash: how often it was tried, by the job's id
    meshcone:fetches:bytes      hash: bytes that were fetched for such a job and are counted, by its
                                id; see worker.jobs.fetch_accounts
    meshcone:outputs            sorted set: results to be put somewhere, as ID/artifact, by the
                                time at which that is to be tried; see worker.transfers
    meshcone:outputs:tries      hash: how often it was tried
    meshcone:blobs:…            see worker.storage.register
    meshcone:idempotency:HASH   see worker.jobs.idempotency

The scripts build some of these names themselves, so a cluster of brokers is not possible.
"""

from __future__ import annotations

COUNTERS = "meshcone:counters"
PROJECTS = "meshcone:projects"
QUEUE_LINES = "meshcone:lines:queue"
FETCH_LINES = "meshcone:lines:fetches"
TURN = "meshcone:lines:turn"
BATCHES = "meshcone:batches"
OPEN_BATCHES = "meshcone:batches:open"
PLACED = "meshcone:projects:placed"
WEBHOOKS = "meshcone:webhooks"
FETCHES = "meshcone:fetches"
DELIVERIES = "meshcone:outputs"
DELIVERY_TRIES = "meshcone:outputs:tries"
FETCH_TRIES = "meshcone:fetches:tries"
FETCHED_BYTES = "meshcone:fetches:bytes"
BLOB_REFERENCES = "meshcone:blobs:references"
BLOB_LEASES = "meshcone:blobs:leases"
BLOB_GENERATIONS = "meshcone:blobs:generations"
DOOMED_BLOBS = "meshcone:blobs:doomed"


def job_keys(job_id: str) -> tuple[str, str, str]:
    """Hash, events and blobs of a job."""
    key = f"meshcone:job:{job_id}"
    return key, f"{key}:events", f"{key}:blobs"


def batch_key(batch: str) -> str:
    """The hash of a batch."""
    return f"meshcone:batch:{batch}"


def judgements_of(batch: str) -> str:
    """What the reports of a batch's jobs say."""
    return f"{batch_key(batch)}:judgements"


def all_jobs(project: str | None = None, batch: str | None = None, *, alone: bool = False) -> str:
    """The index of a batch's jobs, or of a project's; None is no such limit, here and below.

    With ``alone``, of those jobs that belong to no batch.
    """
    return f"{_place(project, batch, alone)}index:all"


def index_of(
    kind: str,
    value: str,
    project: str | None = None,
    batch: str | None = None,
    *,
    alone: bool = False,
) -> str:
    """The index of the jobs whose state, label or verdict has a value; limits as above."""
    return f"{_place(project, batch, alone)}index:{kind}:{value}"


def since(state: str, project: str | None = None) -> str:
    """The jobs of a state, by the time they entered it."""
    return f"{_place(project)}since:{state}"


def batches_of(project: str | None) -> str:
    """The batches of a project."""
    return f"{_place(project)}batches"


def counters(project: str | None = None) -> str:
    """What has happened to the jobs."""
    return f"{_place(project)}counters"


def blobs_of(project: str) -> str:
    """The files of a project's jobs."""
    return f"{_place(project)}blobs"


def _place(project: str | None, batch: str | None = None, alone: bool = False) -> str:
    if batch is not None:
        return f"{batch_key(batch)}:"
    place = "meshcone:" if project is None else f"meshcone:project:{project}:"
    return f"{place}alone:" if alone else place
