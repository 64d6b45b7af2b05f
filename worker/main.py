"""The worker process."""

from __future__ import annotations

import logging

from meshcone.threads import use_one_thread


def main() -> None:
    """Work until SIGTERM or SIGINT, and end after the job in hand; a second signal ends at once.

    Raises:
        InputError: the environment's settings cannot be used.
    """
    use_one_thread()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s")

    from meshcone.settings import load_settings
    from worker.settings import WorkerSettings

    settings = load_settings(WorkerSettings)
    url = settings.required_redis_url()

    import worker.task  # noqa: F401 - 2.5 s of imports, paid here once and not in every horse
    from worker.connections import connect_bytes, connect_text
    from worker.failures import FailureRecorder
    from worker.ledger import Ledger
    from worker.queue import JobQueue
    from worker.rq_worker import TiedWorker

    recorder = FailureRecorder(Ledger(connect_text(url)), settings.attempts)
    connection = connect_bytes(url)
    queue = JobQueue(settings, connection).rq
    TiedWorker(
        [queue],
        connection=connection,
        serializer=queue.serializer,
        worker_ttl=settings.worker_ttl,
        job_monitoring_interval=settings.monitoring_interval,
        maintenance_interval=settings.maintenance_interval,
        exception_handlers=[recorder.on_exception],
        work_horse_killed_handler=recorder.on_killed_horse,
    ).work()


if __name__ == "__main__":
    main()
