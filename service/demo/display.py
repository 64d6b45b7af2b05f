"""What the demonstration shows while it runs."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

if TYPE_CHECKING:
    from service.api.schemas import Job


class Display:
    """Steps as lines; the job as a live bar on a terminal and as lines in a log."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._started = time.monotonic()
        self._bar = Progress(
            TextColumn("        {task.description}", markup=False),
            BarColumn(),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("queued", total=1.0, visible=False)
        self._last = ""

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._bar.stop()

    def step(self, text: str) -> None:
        """Say what has begun or happened."""
        seconds = time.monotonic() - self._started
        line = f"{seconds:5.1f} s  {text}"
        self._console.print(line, highlight=False, markup=False, soft_wrap=True)

    def job(self, job: Job) -> None:
        """Show how far a job has come."""
        description = describe(job)
        if job.state == "running" and job.progress is not None:
            self._bar.update(
                self._task,
                description=f"{description:<25}",
                completed=job.progress.fraction,
                visible=True,
            )
        if job.state == "succeeded":
            self._bar.update(self._task, visible=False)
        if description != self._last and (self._bar.disable or job.state != "running"):
            self.step(f"job {description}")
        self._last = description


def describe(job: Job) -> str:
    """A job's state in a few words."""
    progress = job.progress
    if job.state != "running" or progress is None:
        return job.state
    if progress.stage == "solve" and progress.rounds:
        return f"solve, {progress.round} of {progress.rounds} rounds done"
    return progress.stage
