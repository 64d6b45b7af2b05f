"""The command line, without waiting for its imports each time.

Commands are forked from a process that has imported what most of them need, as a worker forks its
horses: each has a process, arguments, environment, directory and streams of its own. What depends
on how Python starts, such as ``-P`` or a ``sitecustomize``, needs a process started as usual.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import json
import os
import runpy
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NoReturn

from meshcone.threads import use_one_thread

Finished = subprocess.CompletedProcess[str]

PROGRAM = "service.cli"
_IMPORTED = (PROGRAM, "meshcone.library.functions", "meshcone.verbs.measure", "service.client")


def meshcone(directory: Path, *arguments: str | Path, **variables: str) -> Finished:
    """Run a command to its end, in a directory and with some more variables."""
    words = [str(each) for each in arguments]
    with TemporaryDirectory() as name:
        streams = [os.devnull, *(str(Path(name, stream)) for stream in ("out", "err"))]
        code = _parent.run(words, directory, {**os.environ, **variables}, streams)
        out, err = (Path(stream).read_text() for stream in streams[1:])
    return Finished(["meshcone", *words], code, out, err)


def assert_refused(finished: Finished, said: str, code: int = 2) -> None:
    """It has ended with a code and one line that says so."""
    assert finished.returncode == code
    assert said in finished.stderr
    assert finished.stderr.startswith("meshcone: ")
    assert finished.stderr.count("\n") == 1


class _Parent:
    """The process that commands are forked from, one at a time; it ends with this one."""

    def __init__(self) -> None:
        self._one = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None

    def run(
        self,
        arguments: list[str],
        directory: Path,
        environment: Mapping[str, str],
        streams: list[str],
    ) -> int:
        """The exit code of a command, or the negative number of the signal that ended it."""
        with self._one:
            process = self._running()
            assert process.stdin is not None
            assert process.stdout is not None
            request = [arguments, str(directory), environment, streams]
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.flush()
            child = int(process.stdout.readline())
            try:
                return int(process.stdout.readline())
            except BaseException:  # a time-out: the next would be told the code of this one
                with suppress(ProcessLookupError):
                    os.kill(child, signal.SIGKILL)
                process.kill()
                process.communicate()
                self._process = None
                raise

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE
            )
        return self._process


_parent = _Parent()


def _serve() -> None:
    """Fork a command for each request; tell its process id, and its exit code in the end."""
    use_one_thread()
    for module in _IMPORTED:
        importlib.import_module(module)
    gc.freeze()  # or the first collection of each command would copy all of it
    with os.fdopen(os.dup(0), "rb") as requests, os.fdopen(os.dup(1), "wb", buffering=0) as answers:
        for request in requests:
            child = os.fork()
            if child == 0:
                _become(*json.loads(request))
            answers.write(b"%d\n" % child)
            _, status = os.waitpid(child, 0)
            answers.write(b"%d\n" % os.waitstatus_to_exitcode(status))


def _become(
    arguments: list[str], directory: str, environment: dict[str, str], streams: list[str]
) -> NoReturn:
    """Do as ``python -m service.cli`` does that is started in a directory."""
    for number, place in enumerate(streams):
        descriptor = os.open(place, os.O_RDONLY if number == 0 else os.O_WRONLY | os.O_CREAT)
        os.dup2(descriptor, number)
        os.close(descriptor)
    os.chdir(directory)
    os.environ.clear()
    os.environ.update(environment)
    sys.path[0] = directory
    sys.argv[1:] = arguments
    code: Any = 0
    try:
        runpy.run_module(PROGRAM, run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        code = ended.code
    finally:
        _finish()
    os._exit(code or 0)


def _finish() -> None:
    """What Python does at its end, but for taking down thousands of objects one by one."""
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()


if __name__ == "__main__":
    _serve()
