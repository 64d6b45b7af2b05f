"""Every error of the API, as RFC 9457 problem details."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel, Field
from redis.exceptions import OutOfMemoryError, ReadOnlyError, RedisError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.routing import Match

from meshcone.errors import ErrorKind, MeshConeError
from meshcone.text import as_text
from worker.disk import has_room
from worker.jobs.records import JobError
from worker.storage.errors import DamagedFileError, StoreError

logger = logging.getLogger(__name__)

MEDIA_TYPE = "application/problem+json"
TYPE_PREFIX = "urn:meshcone:problem:"
SECURITY_HEADERS = {
    # A mesh or a report is never to be taken for a page or a script.
    "X-Content-Type-Options": "nosniff",
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    # No page of another site may show an answer as its own image, script or frame.
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}


@dataclass(frozen=True)
class ProblemType:
    """One kind of problem: who is responsible, the HTTP status, and a title for all of its kind."""

    kind: ErrorKind
    status: int
    title: str


PROBLEM_TYPES: Mapping[str, ProblemType] = {
    # what the engine and a job can say; the names are those of meshcone.errors
    "input": ProblemType("input", 422, "The files or options cannot be used"),
    "limit": ProblemType("limit", 413, "More than this installation accepts"),
    "infeasible": ProblemType("infeasible", 422, "The constraints contradict each other"),
    "timeout": ProblemType("timeout", 504, "The job ran out of time"),
    "memory": ProblemType("memory", 500, "The job ran out of memory"),
    "crash": ProblemType("crash", 500, "The process that ran the job died"),
    "internal": ProblemType("internal", 500, "A fault of the service"),
    # what only HTTP can say
    "bad-request": ProblemType("input", 400, "The request cannot be read"),
    "unauthorized": ProblemType("input", 401, "An API key is needed"),
    "forbidden": ProblemType("input", 403, "Not permitted"),
    "not-found": ProblemType("input", 404, "Not found"),
    "method-not-allowed": ProblemType("input", 405, "Method not allowed"),
    "media-type": ProblemType("input", 415, "The request is not a multipart form"),
    "slow-request": ProblemType("input", 408, "The request came too slowly"),
    "gone": ProblemType("input", 410, "No longer available"),
    "range": ProblemType("input", 416, "The file has no such part"),
    "hash-mismatch": ProblemType("input", 422, "The content has another hash than its name"),
    "key-in-use": ProblemType("input", 409, "The Idempotency-Key is in use"),
    "key-reused": ProblemType("input", 422, "The Idempotency-Key was used for something else"),
    "finished": ProblemType("input", 409, "The job has ended already"),
    "not-finished": ProblemType("input", 409, "The job has not finished"),
    "job-failed": ProblemType("input", 409, "The job made no result"),
    "rate-limit": ProblemType("limit", 429, "Too many requests"),
    "quota": ProblemType("limit", 429, "More than this API key may use"),
    "queue-full": ProblemType("limit", 503, "Too many jobs are waiting"),
    "unavailable": ProblemType("internal", 503, "The service cannot work just now"),
}

_METHODS = ("DELETE", "GET", "HEAD", "PATCH", "POST", "PUT")
_BY_STATUS = {400: "bad-request", 404: "not-found", 405: "method-not-allowed", 413: "limit"}


class Problem(BaseModel):
    """Problem details (RFC 9457), with three members of our own and a job's own error."""

    type: str = Field(description="identifies the kind of problem; stable")
    title: str = Field(description="the kind of problem in words; the same for each type")
    status: int = Field(description="HTTP status this problem has, or would have had, as an answer")
    detail: str = Field(description="what went wrong this time, in one line")
    kind: ErrorKind = Field(
        description="who is responsible: the sender for input and limit, whoever chose the options "
        "for infeasible, the operator for timeout, memory, crash and internal"
    )
    file: str | None = Field(default=None, description="the sent file it concerns")
    place: str | None = Field(default=None, description="where in that file")
    error: Problem | None = Field(default=None, description="the error the job itself ended with")


class ProblemError(Exception):
    """Raised by a route to answer with a problem."""

    def __init__(self, problem: Problem, headers: Mapping[str, str] | None = None) -> None:
        super().__init__(problem.detail)
        self.problem = problem
        self.headers = headers


def problem(
    name: str,
    detail: str,
    *,
    file: str | None = None,
    place: str | None = None,
    error: Problem | None = None,
) -> Problem:
    """A problem of one of the types above."""
    problem_type = PROBLEM_TYPES[name]
    return Problem(
        type=TYPE_PREFIX + name,
        title=problem_type.title,
        status=problem_type.status,
        detail=as_text(detail),
        kind=problem_type.kind,
        file=None if file is None else as_text(file),
        place=None if place is None else as_text(place),
        error=error,
    )


def problem_of(error: MeshConeError | JobError) -> Problem:
    """The problem an error of the engine, or of a job, amounts to."""
    return problem(error.kind, error.message, file=error.file, place=error.place)


def problem_response(answer: Problem, headers: Mapping[str, str] | None = None) -> JSONResponse:
    """The HTTP answer of a problem."""
    return JSONResponse(
        answer.model_dump(exclude_none=True),
        status_code=answer.status,
        headers={**SECURITY_HEADERS, **(headers or {})},
        media_type=MEDIA_TYPE,
    )


def broker_problem(error: Exception, data_dir: Path) -> ProblemError:
    """What to raise where the broker has failed; the log says how, the answer does not.

    Args:
        error: of the broker's client.
        data_dir: where the embedded broker writes. If its disk is full, the answer says so.
    """
    logger.error("the broker cannot be used: %s", error)
    detail = _broker_words(error)
    with suppress(OSError):  # an API with a broker elsewhere may have no such directory
        if not has_room(data_dir):
            detail = "the disk of the data directory is full; work goes on when it has room"
    return ProblemError(problem("unavailable", detail), {"Retry-After": "5"})


def _broker_words(error: Exception) -> str:
    if isinstance(error, OutOfMemoryError):
        return "the job broker is at its memory limit (maxmemory): raise it, or delete jobs"
    if isinstance(error, ReadOnlyError):
        return "the job broker is a replica, which takes no writes"
    if "MISCONF" in str(error):
        return "the job broker cannot save to its disk; its own log says why"
    return "the job broker cannot be reached; try again later"


def queue_full() -> ProblemError:
    """What to raise where no more jobs are let in."""
    return ProblemError(
        problem("queue-full", "the queue is full; try again later"),
        {"Retry-After": "10"},
    )


def key_reused() -> ProblemError:
    """What to raise where a key belongs to another request."""
    return ProblemError(
        problem("key-reused", "this Idempotency-Key belongs to a request with other content")
    )


def install_handlers(app: FastAPI) -> None:
    """Have every exception of the application answered with a problem."""
    app.add_exception_handler(ProblemError, _on_problem)
    app.add_exception_handler(MeshConeError, _on_meshcone_error)
    app.add_exception_handler(RequestValidationError, _on_invalid_request)
    app.add_exception_handler(HTTPException, _on_http_exception)
    app.add_exception_handler(RedisError, _on_broker_error)
    app.add_exception_handler(ClientDisconnect, _on_disconnect)
    app.add_exception_handler(StoreError, _on_store_error)
    app.add_exception_handler(DamagedFileError, _on_damaged_file)
    app.add_exception_handler(Exception, _on_unexpected)


def _on_problem(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, ProblemError)  # noqa: S101 - for the type checker
    return problem_response(error.problem, error.headers)


def _on_meshcone_error(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, MeshConeError)  # noqa: S101 - for the type checker
    return problem_response(problem_of(error))


def _on_invalid_request(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)  # noqa: S101 - for the type checker
    first: dict[str, Any] = error.errors()[0]
    place, name = first["loc"][:2]  # beyond them stand names of our own types
    return problem_response(problem("input", f"{place} parameter '{name}': {first['msg'].lower()}"))


def _on_http_exception(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)  # noqa: S101 - for the type checker
    name = _BY_STATUS.get(error.status_code, "internal")
    details = {
        "not-found": f"there is nothing at {request.url.path}",
        "method-not-allowed": f"{request.method} is not possible at {request.url.path}",
    }
    headers = dict(error.headers or {})
    if name == "method-not-allowed":
        headers["Allow"] = ", ".join(_methods_at(request))
    return problem_response(problem(name, details.get(name, error.detail)), headers)


def _methods_at(request: Request) -> list[str]:
    """All methods possible at a path; the framework names those of the first route alone."""
    return [
        method
        for method in _METHODS
        if any(
            route.matches({**request.scope, "method": method})[0] is Match.FULL
            for route in request.app.routes
        )
    ]


def _on_broker_error(request: Request, error: Exception) -> JSONResponse:
    answer = broker_problem(error, request.app.state.settings.data_dir)
    return problem_response(answer.problem, answer.headers)


def _on_disconnect(_request: Request, _error: Exception) -> JSONResponse:
    # Nobody reads it; without it, each such request is a fault with a traceback in the log.
    return problem_response(problem("bad-request", "the client went before its request was whole"))


def _on_store_error(_request: Request, error: Exception) -> JSONResponse:
    return problem_response(problem("unavailable", str(error)), {"Retry-After": "5"})


def _on_damaged_file(_request: Request, error: Exception) -> JSONResponse:
    return problem_response(problem("internal", str(error)))


def _on_unexpected(_request: Request, _error: Exception) -> JSONResponse:
    # The server logs the exception; it says nothing to, and is not meant for, the caller.
    return problem_response(
        problem("internal", "an unexpected error in the service; it has been logged")
    )
