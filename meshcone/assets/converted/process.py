"""A file of a design program in, a GLB out.

The readers are large programs that were written for files from friends: hostile ones can make
them allocate or calculate without end, or crash. So they run in a process of their own, with
bounds on memory and time, and die there.
"""

from __future__ import annotations

import errno
import importlib.util
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from meshcone.assets.converted.child import ANSWER, DONE, HEAD, OUT_OF_MEMORY, REFUSED
from meshcone.assets.converted.formats import Converted
from meshcone.assets.limits import Limits
from meshcone.errors import InputError, InternalError, LimitError
from meshcone.lifeline import tied_command

_CHILD = Path(__file__).with_name("child.py")
_UNEXPECTED = 1  # exit code of Python where an exception is not caught
_INHERITED = ("PATH", "LANG", "TZ", "SYSTEMROOT")
_INHERITED_PREFIXES = ("LD_", "DYLD_")


def convert(
    kind: Converted, data: bytes, chord: float | None, limits: Limits
) -> tuple[bytes, float]:
    """Turn a file into a GLB.

    Args:
        kind: its format.
        data: its bytes.
        chord: how far triangles may lie from the surfaces they stand for, in its unit; None for
            a share of its size.
        limits: how much memory and time it may take.

    Returns:
        The GLB, and the chord that was kept; 0 where the file holds triangles.

    Raises:
        InputError: the reader is not installed, refuses the file, or crashes over it.
        LimitError: it takes more memory or time than ``limits`` allow.
        OSError: its temporary files find no room.
    """
    if importlib.util.find_spec(kind.package) is None:
        raise InputError(
            f"this is {kind.called}, which the extra '{kind.extra}' reads, and that is not "
            f"installed here: pip install 'meshcone[{kind.extra}]'"
        )
    seconds = limits.convert_seconds
    head = HEAD.pack(limits.convert_memory_bytes, seconds, chord or 0.0)
    try:
        # Python finds the place by writing there, which the caller itself may not be allowed to.
        place = None if os.name == "nt" else os.environ.get("TMPDIR", "/tmp")  # noqa: S108
        with tempfile.TemporaryDirectory(dir=place) as scratch:
            run = subprocess.run(  # noqa: S603 - our own interpreter and file
                tied_command([sys.executable, "-I", str(_CHILD), kind.name], signal.SIGKILL),
                input=head + data,
                capture_output=True,
                cwd=scratch,
                env={**_environment(), "TMPDIR": scratch},
                timeout=seconds,
                check=False,
            )
    except subprocess.TimeoutExpired:
        raise _too_slow(kind, seconds) from None
    if run.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        raise _too_slow(kind, seconds)
    if run.returncode == _UNEXPECTED and b"MemoryError" in run.stderr:
        raise _too_large(kind, limits)
    if run.returncode == _UNEXPECTED:
        last = run.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        if f"[Errno {errno.ENOSPC}]" in last:  # of the disk, which may have room another time
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        raise InternalError(f"the reader of {kind.called} cannot be run here: {last[:200]}")
    if run.returncode or len(run.stdout) < ANSWER.size:
        raise InputError(
            f"this is {kind.called} that makes its reader crash (exit code {run.returncode})"
        )
    return _answer(kind, run.stdout, limits)


def _answer(kind: Converted, said: bytes, limits: Limits) -> tuple[bytes, float]:
    status, kept = ANSWER.unpack_from(said)
    found = said[ANSWER.size :]
    if status == OUT_OF_MEMORY:
        raise _too_large(kind, limits)
    if status == REFUSED:
        words = found.decode(errors="replace")
        raise InputError(f"this is {kind.called} that cannot be read: {words[:300]}")
    if status != DONE:
        raise InternalError(f"the reader of {kind.called} answers with {status}")
    return found, kept


def _too_slow(kind: Converted, seconds: int) -> LimitError:
    return LimitError(
        f"this is {kind.called} that takes more than the {seconds} seconds allowed here for "
        "reading it (MESHCONE_LIMIT_CONVERT_SECONDS)"
    )


def _too_large(kind: Converted, limits: Limits) -> LimitError:
    return LimitError(
        f"this is {kind.called} that takes more than the {limits.convert_memory_bytes:,} bytes of "
        "memory allowed here for reading it (MESHCONE_LIMIT_CONVERT_MEMORY_BYTES)"
    )


def _environment() -> dict[str, str]:
    """What the process needs to run, and no secret of this one."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if name in _INHERITED or name.startswith(_INHERITED_PREFIXES)
    }
    return {**kept, "PXR_WORK_THREAD_LIMIT": "1"}
