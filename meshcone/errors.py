"""The errors MeshCone raises on purpose.

Each carries a *public* message, written for the person who sent the file, and a
``kind`` that says who is responsible: the sender for ``input`` and ``limit``, whoever chose
the options for ``infeasible``, the operator for ``timeout``, ``memory``, ``crash`` and
``internal``.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import ClassVar, Literal

from meshcone.text import as_text

ErrorKind = Literal["input", "limit", "infeasible", "timeout", "memory", "crash", "internal"]


class MeshConeError(Exception):
    """Base of every error with a public message.

    Args:
        message: one sentence, free of paths and stack frames: what was found and what
            was expected.
        file: the name of the sent file it concerns, if it concerns one.
        place: where in that file: a JSON pointer or ``line 12``.
    """

    kind: ClassVar[ErrorKind] = "internal"

    def __init__(self, message: str, *, file: str | None = None, place: str | None = None) -> None:
        self.message = as_text(message)  # a sender's file can name things by half a character
        super().__init__(self.message)
        self.file = None if file is None else as_text(file)
        self.place = None if place is None else as_text(place)

    def __str__(self) -> str:
        where = ", ".join(part for part in (self.file, self.place) if part)
        return f"{where}: {self.message}" if where else self.message


class InputError(MeshConeError):
    """The file or the options cannot be used as they are."""

    kind = "input"


class ArgumentError(InputError, TypeError):
    """An argument of a function is of a type that the function does not take."""


class LimitError(MeshConeError):
    """The file is larger, deeper or longer than this installation accepts."""

    kind = "limit"


class InfeasibleError(MeshConeError):
    """The requested constraints contradict each other: no mesh satisfies them all."""

    kind = "infeasible"


class SolveTimeoutError(MeshConeError):
    """The time allowed for the job ran out before the program was solved."""

    kind = "timeout"


class OutOfMemoryError(MeshConeError):
    """The job needs more memory than it may have."""

    kind = "memory"


class CrashError(MeshConeError):
    """The process that ran the job died, and not of the causes that have a kind of their own."""

    kind = "crash"


class InternalError(MeshConeError):
    """A fault of ours: the file is not to blame."""

    kind = "internal"


@contextmanager
def naming(file: str) -> Iterator[None]:
    """Add the file's name to errors raised where only its content is known."""
    try:
        yield
    except MeshConeError as error:
        error.file = error.file or file
        raise
