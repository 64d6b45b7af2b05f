"""What a work horse may use and reach.

Limits are the kernel's and hold for native code too. The network guard sees what Python
does and no more: it stops a library that fetches something, not an attacker who runs code
of their own. That is for the network the worker is on: docker-compose.yml gives it one
without a way out.
"""

from __future__ import annotations

import ctypes
import resource
import socket
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote, urlsplit

if TYPE_CHECKING:
    from collections.abc import Collection

    from worker.settings import WorkerSettings

_PR_SET_NO_NEW_PRIVS = 38  # linux/prctl.h
_CPU_SLACK = 60  # seconds of processor time beyond the time limit, for threads of the blob store
_CPU_GRACE = 5  # seconds between the signal that can be told apart and the one that cannot

_DEFAULT_PORT = 6379

Address = tuple[str, int] | str


def confine(settings: WorkerSettings) -> None:
    """Give up, for this process and for good, what a job needs not.

    Core files, processor time beyond the job's, memory and file sizes beyond the
    installation's limits, new privileges, other programs than this interpreter (a decoder
    runs in one), and every address but the broker's. The blob store's client is native code
    the guard does not see.
    """
    limit_resources(
        seconds=settings.job_timeout + _CPU_SLACK,
        memory=settings.job_memory_bytes or None,
        file_bytes=settings.job_file_bytes or None,
    )
    guard_network(addresses_of(settings.required_redis_url()))


def limit_resources(
    *,
    seconds: int,
    memory: int | None,
    file_bytes: int | None,
    file_bytes_below: int | None = None,
) -> None:
    """Bound what this process may use, have it leave no core file and gain no privileges.

    Args:
        seconds: of processor time; ``SIGXCPU`` comes then, and the end a little later.
        memory: bytes beyond those it holds already; None for no limit.
        file_bytes: size of any file it writes; None for no limit.
        file_bytes_below: the same for programs it starts, if they may write larger ones.
    """
    _limit(resource.RLIMIT_CORE, 0)
    _limit(resource.RLIMIT_CPU, seconds, seconds + _CPU_GRACE)
    if file_bytes is not None:
        _limit(resource.RLIMIT_FSIZE, file_bytes, file_bytes_below)
    if memory is not None:
        # Private memory that can be written. Address space would be no measure: thread stacks
        # and arenas reserve far more of it than they use.
        _limit(resource.RLIMIT_DATA, _data_held() + memory)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)


def guard_network(allowed: Collection[Address]) -> None:
    """Refuse connections from Python code to other addresses, and other programs.

    An audit hook (PEP 578) cannot be removed.

    Raises:
        PermissionError: later, where something is refused.
    """

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "socket.connect":
            address = arguments[1]
            if (tuple(address[:2]) if isinstance(address, tuple) else address) not in allowed:
                raise PermissionError("a job may reach the broker and the blob store only")
        elif event == "subprocess.Popen" and arguments[0] != sys.executable:
            raise PermissionError("a job may not start other programs")

    sys.addaudithook(hook)


def addresses_of(redis_url: str) -> frozenset[Address]:
    """The socket addresses behind a broker's URL."""
    url = urlsplit(redis_url)
    if url.scheme == "unix":
        return frozenset({unquote(url.path)})
    host, port = url.hostname or "localhost", url.port or _DEFAULT_PORT
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    # The client hands the kernel what getaddrinfo answers, but a fresh look may answer anew.
    return frozenset({(host, port), *((str(each[4][0]), port) for each in found)})


def _limit(which: int, soft: int, hard: int | None = None) -> None:
    _, highest = resource.getrlimit(which)
    if hard is None:
        hard = soft
    if highest != resource.RLIM_INFINITY:
        soft, hard = min(soft, highest), min(hard, highest)
    resource.setrlimit(which, (soft, hard))


def _data_held() -> int:
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
    except FileNotFoundError:  # no such file but on Linux
        return 0
    [line] = [line for line in status.splitlines() if line.startswith("VmData:")]
    return int(line.split()[1]) * 1024
