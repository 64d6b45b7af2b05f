"""What the kernel has ended for its memory, in this process's group of control."""

from __future__ import annotations

from pathlib import Path


def oom_kills(membership: Path = Path("/proc/self/cgroup")) -> int:
    """Processes the kernel has ended so far; 0 where nobody counts them.

    Control groups of version 2 count (``memory.events``, Linux admin guide, "Control Group
    v2"); a container has one of its own.
    """
    try:
        lines = membership.read_text(encoding="ascii").splitlines()
        [group] = [line.removeprefix("0::/") for line in lines if line.startswith("0::/")]
        events = (Path("/sys/fs/cgroup") / group / "memory.events").read_text(encoding="ascii")
        counts = dict(line.split() for line in events.splitlines())
        return int(counts["oom_kill"])
    except (OSError, ValueError, KeyError):
        return 0
