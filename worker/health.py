"""``python -m worker.health``: whether a worker on this machine is alive, as an exit code.

For supervisors that know a process is there, but not whether it still does anything: a
worker that hangs stops its heartbeat, and the broker forgets it.
"""

from __future__ import annotations

import sys

from redis.exceptions import RedisError

from meshcone.errors import InputError
from meshcone.settings import load_settings
from worker.broker.connections import connect_bytes
from worker.jobs.queue import JobQueue
from worker.settings import WorkerSettings


def main() -> int:
    """Return 0 if the broker knows a worker of this machine, else 1, saying why on stderr."""
    try:
        settings = load_settings(WorkerSettings)
        with connect_bytes(settings.required_redis_url()) as client:
            alive = JobQueue(settings, client).local_worker_pids()
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    except RedisError as error:
        print(f"the broker cannot be reached: {error}", file=sys.stderr)
        return 1
    if not alive:
        print("no worker of this machine is known to the broker", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
