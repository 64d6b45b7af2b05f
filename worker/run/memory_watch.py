"""Telling a lack of memory from other deaths."""

from __future__ import annotations

import resource
import signal
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from worker.run.horse import MAXRSS_UNIT, Death

_OF_CODE_THAT_GOT_NONE = (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS)


@dataclass(frozen=True)
class MemoryWatch:
    """What was so before a horse started.

    Python code that gets no memory raises ``MemoryError``. Native code that gets none often
    dies of it (SCS writes to address 0), and what the kernel ends to save the machine just
    disappears.

    Attributes:
        limit: bytes a horse may take beyond what its worker holds; 0 for no limit.
        held: bytes the worker held at most.
        killed: processes the kernel had ended for their memory.
    """

    limit: int
    held: int
    killed: int

    @classmethod
    def start(cls, limit: int) -> Self:
        """Look now."""
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return cls(limit, peak * MAXRSS_UNIT, oom_kills())

    def explains(self, death: Death) -> bool:
        """Whether a lack of memory is the likely cause of a death.

        For native code that is a judgement: one of the signals it dies of, with more than
        half of the limit in use.
        """
        if oom_kills() > self.killed:
            return True
        taken = death.peak_memory - self.held
        return death.signal in _OF_CODE_THAT_GOT_NONE and 0 < self.limit < 2 * taken


def oom_kills(
    membership: Path = Path("/proc/self/cgroup"), groups: Path = Path("/sys/fs/cgroup")
) -> int:
    """Processes the kernel has ended so far; 0 where nobody counts them.

    Control groups of version 2 count (``memory.events``, Linux admin guide, "Control Group
    v2"); a container has one of its own.
    """
    try:
        lines = membership.read_text(encoding="ascii").splitlines()
        [group] = [line.removeprefix("0::/") for line in lines if line.startswith("0::/")]
        events = (groups / group / "memory.events").read_text(encoding="ascii")
        counts = dict(line.split() for line in events.splitlines())
        return int(counts["oom_kill"])
    except (OSError, ValueError, KeyError):
        return 0
