"""The worker process."""

from __future__ import annotations

import gc
import sys

from meshcone.threads import use_one_thread


def main() -> None:
    """Work until SIGTERM or SIGINT; what becomes of the job in hand, worker.run.stopping says.

    Raises:
        InputError: the environment's settings cannot be used.
    """
    use_one_thread()

    from worker.broker.patience import wait_for_broker
    from worker.logs import configure_logging

    configure_logging()

    from meshcone.scratch import remove_orphans
    from meshcone.settings import load_settings
    from worker.run.stopping import StopRequest
    from worker.settings import WorkerSettings
    from worker.upkeep.main import UpkeepProcess

    settings = load_settings(WorkerSettings)
    url = settings.required_redis_url()
    stop = StopRequest(settings.stop_grace)
    stop.listen()
    upkeep = UpkeepProcess()
    upkeep.keep()
    remove_orphans()

    # 2.5 s of imports: paid here once and not in every horse. Nothing of them becomes garbage, for
    # which Python would look hundreds of times meanwhile.
    gc.disable()
    import worker.run.task
    from worker.broker.connections import connect_bytes, connect_text
    from worker.jobs.heartbeats import Heartbeats
    from worker.jobs.ledger import Ledger
    from worker.jobs.queue import JobQueue
    from worker.run.attempt import Attempts
    from worker.run.warming import warm_up
    from worker.run.worker import MeshWorker

    warm_up()
    gc.enable()
    client, connection = connect_text(url), connect_bytes(url)
    wait_for_broker(client, until=lambda: stop.made)
    attempts = Attempts(
        settings,
        ledger=Ledger(client),
        queue=JobQueue(settings, connection),
        heartbeats=Heartbeats(client, settings.heartbeat_timeout),
        stop=stop,
        work=worker.run.task.run,
    )
    if not stop.made:
        MeshWorker(attempts, connection, upkeep.keep).work(logging_level="WARNING")
    upkeep.end()
    if not stop.made:
        sys.exit("the worker ended unexpectedly")  # RQ's loop has logged why


if __name__ == "__main__":
    main()
