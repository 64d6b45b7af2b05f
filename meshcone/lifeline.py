"""Ties a process's life to its parent's.

``python lifeline.py PARENT SIGNAL COMMAND…`` becomes COMMAND, which receives
SIGNAL when process PARENT ends, however it ends. The request is made in the child,
after the fork, because a hook between fork and exec is unsafe in a parent with threads.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Sequence

_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def die_with_parent(parent_pid: int, death_signal: signal.Signals) -> None:
    """Have the kernel send ``death_signal`` to this process when its parent ends.

    Linux only; elsewhere it does nothing, and orphans are left to whoever stops them.
    """
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(death_signal))
    if os.getppid() != parent_pid:  # it ended before the kernel was asked
        os.kill(os.getpid(), death_signal)


def tied_command(command: Sequence[str], death_signal: signal.Signals) -> list[str]:
    """The command line that runs ``command`` as a child that does not outlive this process.

    More exactly, the thread that starts it: that is who Linux takes for a parent here.
    """
    if sys.platform != "linux":
        return list(command)
    return [
        sys.executable,
        "-I",  # nothing of the working directory or the environment is this program's
        __file__,
        str(os.getpid()),
        str(int(death_signal)),
        *command,
    ]


def main(arguments: Sequence[str]) -> None:
    """Become the command in ``arguments``."""
    parent_pid, death_signal, *command = arguments
    die_with_parent(int(parent_pid), signal.Signals(int(death_signal)))
    os.execvp(command[0], command)  # noqa: S606 - the command is our own, and no shell is wanted


if __name__ == "__main__":
    main(sys.argv[1:])
