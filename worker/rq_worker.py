"""RQ's worker, with its work horse tied to it."""

from __future__ import annotations

import os
import signal
from typing import TYPE_CHECKING

from rq import Worker

from worker.lifeline import die_with_parent

if TYPE_CHECKING:
    from rq import Queue
    from rq.job import Job


class TiedWorker(Worker):
    """A worker whose horse dies with it.

    RQ starts a dead worker's job again; a horse that lived on would then be a second run
    of the same job, with nobody to enforce its time limit.
    """

    def fork_work_horse(self, job: Job, queue: Queue) -> None:
        """Fork, remembering whose child the horse is."""
        self._worker_pid = os.getpid()
        super().fork_work_horse(job, queue)

    def main_work_horse(self, job: Job, queue: Queue) -> None:
        """Run the job in the horse."""
        die_with_parent(self._worker_pid, signal.SIGKILL)
        super().main_work_horse(job, queue)
