"""Standard output and standard error that end no command.

A reader may have enough, as `head` has, and a disk be full. What a command says is then dropped: it
still writes its files, and its exit code says what became of its work.
"""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Literal


class _Output(io.FileIO):
    """A stream that leads nowhere from where it fails on."""

    failure: OSError | None = None

    def write(self, data: Any, /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            self.failure = error
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            return len(data)


@dataclass
class Said:
    """What became of standard output.

    Attributes:
        lost: why it could not be written; None if it could, or its reader had enough.
    """

    lost: OSError | None = None


@contextmanager
def lasting_streams() -> Iterator[Said]:
    """Have the body's output dropped where it cannot be written, and note why."""
    said = Said()
    with ExitStack() as streams:
        streams.enter_context(_lasting("stderr"))
        out = streams.enter_context(_lasting("stdout"))
        yield said
    failure = None if out is None else out.failure
    if failure is not None and failure.errno != errno.EPIPE:
        said.lost = failure


@contextmanager
def _lasting(name: Literal["stdout", "stderr"]) -> Iterator[_Output | None]:
    before = getattr(sys, name)
    try:
        output = _Output(before.fileno(), "w", closefd=False)
        before.flush()
    except (AttributeError, ValueError, OSError):  # closed, or no file
        yield None
        return
    unbuffered = before.write_through
    after = io.TextIOWrapper(
        output if unbuffered else io.BufferedWriter(output),
        before.encoding,
        before.errors,
        line_buffering=before.line_buffering,
        write_through=unbuffered,
    )
    setattr(sys, name, after)
    try:
        yield output
    finally:
        with suppress(ValueError):  # the command has closed it
            after.flush()
        setattr(sys, name, before)
