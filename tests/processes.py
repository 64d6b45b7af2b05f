"""Looking at processes (Linux)."""

from __future__ import annotations

from pathlib import Path


def children_of(pid: int) -> list[int]:
    """Process ids of the processes that ``pid`` has started and that have not ended."""
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return []
    return [int(child) for child in children.split()]


def has_ended(pid: int) -> bool:
    """Whether a process is gone, or dead with all its threads and only not yet waited for."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
        threads = len(list(Path(f"/proc/{pid}/task").iterdir()))
    except (FileNotFoundError, ProcessLookupError):
        return True
    # The first thread can be dead before the others; its parent learns of it after the last.
    return status.rpartition(")")[2].split()[0] == "Z" and threads <= 1


def horses_of(worker: int) -> list[int]:
    """Process ids of a worker's work horses: what it forked and did not start as a program."""
    return [pid for pid in children_of(worker) if not _is_upkeep(pid)]


def upkeep_of(worker: int) -> list[int]:
    """Process ids of a worker's reconciler and housekeeping."""
    return [pid for pid in children_of(worker) if _is_upkeep(pid)]


def _is_upkeep(pid: int) -> bool:
    try:
        return b"worker.upkeep.main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except (FileNotFoundError, ProcessLookupError):
        return False
