"""A service somewhere else, for commands that work there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import httpx2

from meshcone.errors import (
    CrashError,
    InfeasibleError,
    InputError,
    InternalError,
    LimitError,
    MeshConeError,
    OutOfMemoryError,
    SolveTimeoutError,
)
from service.client.client import Client
from service.client.transport import (
    UNSENDABLE_KEY,
    ServiceError,
    UnreadableAnswerError,
    is_sendable_key,
)
from service.problems import Problem

API_KEY_VARIABLE = "MESHCONE_API_KEY"  # an argument could be read by everybody on this machine

_ERRORS: dict[str, type[MeshConeError]] = {
    error.kind: error
    for error in (
        InputError,
        LimitError,
        InfeasibleError,
        SolveTimeoutError,
        OutOfMemoryError,
        CrashError,
        InternalError,
    )
}


def connect(url: str) -> Client:
    """A client of the service at a URL, with the key of the environment.

    Raises:
        InputError: no such service answers, or it does not let us in.
    """
    key = os.environ.get(API_KEY_VARIABLE) or None
    if key is not None and not is_sendable_key(key):
        raise InputError(f"environment variable {API_KEY_VARIABLE}: {UNSENDABLE_KEY}")
    try:
        client = Client(url, api_key=key)
        client.jobs(limit=1)
    except (httpx2.HTTPError, httpx2.InvalidURL, UnicodeError):
        raise InputError(f"no MeshCone service answers at {url}") from None
    except ServiceError as error:
        if error.problem.status == httpx2.codes.UNAUTHORIZED:
            raise InputError(
                f"the service at {url} asks for an API key: set {API_KEY_VARIABLE} to one it knows"
            ) from None
        # A key that may submit alone may not list jobs.
        if error.problem.status != httpx2.codes.FORBIDDEN:
            raise InputError(f"the service at {url} cannot work just now: {error}") from None
    return client


@contextmanager
def service_errors() -> Iterator[None]:
    """Raise what a service refuses, and that it does not answer, as the errors of a command.

    Raises:
        MeshConeError: of the kind that the service's problem has.
        InternalError: it does not answer, or not as a service does.
    """
    try:
        yield
    except ServiceError as error:
        raise error_of(error.problem) from None
    except httpx2.HTTPError as error:
        raise _no_answer(error) from None


def _no_answer(error: httpx2.HTTPError) -> InternalError:
    if isinstance(error, UnreadableAnswerError):
        return InternalError(str(error))
    return InternalError(f"the service does not answer: {error}")


def error_of(problem: Problem) -> MeshConeError:
    """The error that a problem, or the job it tells of, stands for."""
    told = problem if problem.error is None else problem.error
    return _ERRORS[told.kind](told.detail, file=told.file, place=told.place)
