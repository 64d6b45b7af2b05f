"""How far a refinement has come, drawn on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from meshcone.progress import Progress
    from worker.jobs.records import JobProgress

    Moment = Progress | JobProgress


@contextmanager
def progress_bar() -> Iterator[Callable[[Moment], None] | None]:
    """What draws a moment of a refinement, while stderr is a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("read", total=1.0)

        def show(progress: Moment) -> None:
            rounds = f" {progress.round}/{progress.rounds}" if progress.stage == "solve" else ""
            bar.update(task, completed=progress.fraction, description=progress.stage + rounds)

        yield show
