"""The worker process."""

from __future__ import annotations

from meshcone.threads import use_one_thread


def main() -> None:
    """Work until SIGTERM or SIGINT; what becomes of the job in hand, worker.run.stopping says.

    Raises:
        InputError: the environment's settings cannot be used.
    """
    use_one_thread()

    from worker.logs import configure_logging

    configure_logging()

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

    import worker.run.task  # 2.5 s of imports, paid here once and not in every horse
    from worker.broker.connections import connect_bytes, connect_text
    from worker.jobs.heartbeats import Heartbeats
    from worker.jobs.ledger import Ledger
    from worker.jobs.queue import JobQueue
    from worker.run.loop import WorkerLoop
    from worker.run.presence import Presence

    client, connection = connect_text(url), connect_bytes(url)
    queue = JobQueue(settings, connection)
    WorkerLoop(
        settings,
        ledger=Ledger(client),
        queue=queue,
        heartbeats=Heartbeats(client, settings.heartbeat_timeout),
        presence=Presence(queue, connection),
        stop=stop,
        run=worker.run.task.run,
        keep=upkeep.keep,
    ).work()
    upkeep.end()


if __name__ == "__main__":
    main()
