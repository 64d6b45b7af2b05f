"""Requests to a service that may be full, pace its clients or start again."""

from __future__ import annotations

from typing import Any, TypeVar

import httpx2
from pydantic import BaseModel, ValidationError

from meshcone.errors import InputError
from service.client.patience import Patience
from service.problems import MEDIA_TYPE, TYPE_PREFIX, Problem

REQUEST_TIMEOUT = 60.0  # seconds

_PASSING = frozenset({429, 502, 503, 504})  # statuses after which to try again
_KEY_IN_USE = f"{TYPE_PREFIX}key-in-use"


UNSENDABLE_KEY = (
    "the API key has characters in it that no request can carry: expected letters, digits and "
    "signs of ASCII, without spaces or line ends"
)

_Model = TypeVar("_Model", bound=BaseModel)


def is_sendable_key(key: str) -> bool:
    """Whether a header can have an API key in it."""
    return key.isascii() and key.isprintable() and " " not in key


class ServiceError(Exception):
    """The service answered with a problem.

    Attributes:
        problem: what it said.
    """

    def __init__(self, problem: Problem) -> None:
        where = ", ".join(part for part in (problem.file, problem.place) if part)
        super().__init__(f"{where}: {problem.detail}" if where else problem.detail)
        self.problem = problem

    def __reduce__(self) -> tuple[type[ServiceError], tuple[Problem]]:
        return type(self), (self.problem,)  # not by its message, which is made of that


class UnreadableAnswerError(httpx2.HTTPError):
    """What answered is no MeshCone service, or one of another version."""

    @classmethod
    def of(cls, answer: httpx2.Response) -> UnreadableAnswerError:
        """The error that it is to be answered so."""
        asked = answer.request
        error = cls(
            f"what came of {asked.method} {asked.url.path} with status {answer.status_code} is not "
            "an answer of a MeshCone service: look at what is at this address, such as a proxy"
        )
        error.request = asked
        return error


def parsed(model: type[_Model], answer: httpx2.Response) -> _Model:
    """What an answer says.

    Raises:
        UnreadableAnswerError: it is not of this kind.
    """
    try:
        return model.model_validate_json(answer.content)
    except ValidationError:
        raise UnreadableAnswerError.of(answer) from None


def parsed_object(answer: httpx2.Response) -> dict[str, Any]:
    """The JSON object that an answer is.

    Raises:
        UnreadableAnswerError: it is none.
    """
    try:
        found = answer.json()
    except (ValueError, RecursionError):
        raise UnreadableAnswerError.of(answer) from None
    if not isinstance(found, dict):
        raise UnreadableAnswerError.of(answer)
    return found


class Transport:
    """Sends requests, each of which can be repeated without doing anything twice.

    Args:
        base_url: where the service listens.
        api_key: sent with each request, if any.
        patience: seconds a request may spend waiting for a service that cannot answer just now.
            One that has never answered is not waited for.
    """

    def __init__(self, base_url: str, api_key: str | None, patience: float) -> None:
        # A proxy from the environment cannot reach a service on this machine.
        if api_key is not None and not is_sendable_key(api_key):
            raise InputError(UNSENDABLE_KEY)
        is_local = httpx2.URL(base_url).host in ("127.0.0.1", "localhost", "::1")
        self._http = httpx2.Client(
            base_url=base_url,
            headers={} if api_key is None else {"Authorization": f"Bearer {api_key}"},
            timeout=REQUEST_TIMEOUT,
            trust_env=not is_local,
        )
        self._patience = patience
        self._has_answered = False

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def request(self, method: str, path: str, **content: Any) -> httpx2.Response:
        """The answer to a request, if it is a good one.

        Raises:
            ServiceError: it is a problem.
            httpx2.HTTPError: there is none, or not one of a MeshCone service.
            InputError: what is to be sent cannot be.
        """
        answer = self.answer(method, path, **content)
        problem = _problem(answer)
        if problem is not None:
            raise ServiceError(problem)
        answer.raise_for_status()
        if answer.headers.get("content-type", "").startswith("text/html"):
            # The page of a proxy, which must not be taken for a mesh.
            raise UnreadableAnswerError.of(answer)
        return answer

    def answer(self, method: str, path: str, **content: Any) -> httpx2.Response:
        """The answer to a request, whatever it is; repeated as long as there is hope."""
        patience = Patience(self._patience)
        while True:
            try:
                answer = self._http.request(method, path, **content)
            except httpx2.TransportError:
                if self._has_answered and patience.pause():
                    continue
                raise
            except UnicodeEncodeError as error:
                text = error.object[error.start : error.end]
                raise InputError(
                    f"what is to be sent has {text[:10]!a} in it, which no request can carry: "
                    "half of a character, or of a name that is not UTF-8"
                ) from None
            self._has_answered = True
            if not (_is_passing(answer) and patience.pause(answer.headers)):
                return answer


def _is_passing(answer: httpx2.Response) -> bool:
    if answer.status_code in _PASSING:
        return True
    problem = _problem(answer) if answer.status_code == httpx2.codes.CONFLICT else None
    return problem is not None and problem.type == _KEY_IN_USE


def _problem(answer: httpx2.Response) -> Problem | None:
    if not answer.headers.get("content-type", "").startswith(MEDIA_TYPE):
        return None
    try:
        return Problem.model_validate_json(answer.content)
    except ValidationError:  # somebody else's, whose status says enough
        return None
