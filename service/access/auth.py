"""Who may pass: API keys, their scopes, and what holds where none are asked for."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from redis.exceptions import RedisError
from starlette.datastructures import Headers, MutableHeaders

from service.access.keys import KEYS, ApiKey, Scope, parse_token
from service.access.quotas import Allowance, RateLimiter
from service.problems import ProblemError, broker_problem, problem, problem_response

if TYPE_CHECKING:
    from redis.asyncio import Redis as AsyncRedis
    from starlette.types import ASGIApp, Message, Receive, Send
    from starlette.types import Scope as ConnectionScope

    from service.settings import ServiceSettings

_PUBLIC = frozenset({"/livez", "/readyz", "/openapi.json"})
# The documentation and the pages hold nothing of any job: scripts of the pages ask for that, with
# the key of whoever looks.
_PAGES = re.compile(r"/|/(jobs|static)/[^/]+|/compare|/docs|/help(/.*)?|/favicon\.ico")
_UPLOADS = "/v1/blobs/"
_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
_REALM = 'Bearer realm="meshcone"'
_BEARER = re.compile(r"bearer +([\w~+/.=-]+)", re.IGNORECASE)  # RFC 6750, section 2.1


def required_scope(method: str, path: str) -> Scope | None:
    """The scope a request needs; None if it needs no key.

    Decided for every path, known or not, so that a new route is closed until it is opened here.
    """
    if path in _PUBLIC or (method in _SAFE_METHODS and _PAGES.fullmatch(path)):
        return None
    if path.startswith(_UPLOADS):  # whoever sends files asks first which are there
        return "submit"
    if method in _SAFE_METHODS:
        return "read"
    return "delete" if method == "DELETE" else "submit"


def describe_security(document: dict[str, Any]) -> None:
    """Write into an OpenAPI document what each operation needs.

    The scopes stand where OpenAPI 3.1 has roles. The empty alternative is for a server that
    only its own machine reaches.
    """
    document["components"]["securitySchemes"] = {
        "key": {
            "type": "http",
            "scheme": "bearer",
            "description": "an API key, as `meshcone keys create` makes it",
        }
    }
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            scope = required_scope(method.upper(), path)
            operation["security"] = [{}] if scope is None else [{"key": [scope]}, {}]


def is_loopback(host: str) -> bool:
    """Whether an address, or a name in a URL, can only be this machine's."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]").partition("%")[0]).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class _Admission:
    key: ApiKey | None
    headers: Mapping[str, str]


class KeyRing:
    """Looks keys up and counts their requests, without a thread.

    Args:
        client: a connection whose replies are strings.
        settings: what keys may use that have no quota of their own.
    """

    def __init__(self, client: AsyncRedis, settings: ServiceSettings) -> None:
        self._client = client
        self._settings = settings
        self._rates = RateLimiter(client)

    async def admit(self, authorization: str, scope: Scope) -> _Admission:
        """The key of an ``Authorization`` header, if it may do what needs a scope.

        Raises:
            ProblemError: it is unknown, may not, or has made too many requests.
            RedisError: the broker is unreachable.
        """
        key = await self._key(authorization)
        if key is None:
            raise _unauthorized("this API key is not known here", 'error="invalid_token"')
        allowance = Allowance.of(key.quota, self._settings)
        pace = await self._rates.take(key.id, allowance.requests_per_minute)
        headers = {} if pace is None else pace.headers()
        if pace is not None and not pace.allowed:
            detail = f"more than {pace.limit} requests a minute with this API key"
            raise ProblemError(problem("rate-limit", detail), headers)
        if not key.allows(scope):
            challenge = f'{_REALM}, error="insufficient_scope", scope="{scope}"'
            raise ProblemError(
                problem("forbidden", f"this API key lacks the scope '{scope}'"),
                {**headers, "WWW-Authenticate": challenge},
            )
        return _Admission(key, headers)

    async def _key(self, authorization: str) -> ApiKey | None:
        match = _BEARER.fullmatch(authorization.strip())
        token = parse_token(match[1]) if match else None
        if token is None:
            return None
        stored = await self._client.hget(KEYS, token[0])
        key = ApiKey.model_validate_json(stored) if stored else None
        return key if key is not None and key.has_secret(token[1]) else None


class Authentication:
    """ASGI middleware that lets no request pass that may not, before its body is read.

    Args:
        app: what it protects; ``app.state.key_ring`` of the application is asked.
        keys_required: whether every request needs a key. Where it is false, as on a loopback
            address, a key that is sent must be a good one all the same.
        origins: sites whose pages may use the service where it asks for no key.
    """

    def __init__(
        self, app: ASGIApp, *, keys_required: bool, origins: frozenset[str] = frozenset()
    ) -> None:
        self._app = app
        self._keys_required = keys_required
        self._origins = origins

    async def __call__(self, scope: ConnectionScope, receive: Receive, send: Send) -> None:
        """Pass a request on, with its key as ``request.state.key``."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        try:
            admission = await self._admission(scope)
        except ProblemError as refusal:
            # Whatever of a body is still to come is not waited for.
            headers = {**(refusal.headers or {}), "Connection": "close"}
            await problem_response(refusal.problem, headers)(scope, receive, send)
            return
        scope.setdefault("state", {})["key"] = admission.key

        async def send_with_pace(message: Message) -> None:
            if message["type"] == "http.response.start":
                answered = MutableHeaders(scope=message)
                for name, value in admission.headers.items():
                    answered.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_with_pace)

    async def _admission(self, scope: ConnectionScope) -> _Admission:
        needed = required_scope(scope["method"], scope["path"])
        if needed is None:
            return _Admission(None, {})
        headers = Headers(scope=scope)
        authorization = headers.get("authorization")
        if authorization is not None:
            ring: KeyRing = scope["app"].state.key_ring
            try:
                return await ring.admit(authorization, needed)
            except RedisError as error:
                raise broker_problem(error, scope["app"].state.settings.data_dir) from None
        if self._keys_required:
            raise _unauthorized("an API key is needed: send it as 'Authorization: Bearer KEY'")
        _refuse_other_sites(headers, self._origins)
        return _Admission(None, {})


def _unauthorized(detail: str, parameters: str = "") -> ProblemError:
    challenge = f"{_REALM}, {parameters}" if parameters else _REALM
    return ProblemError(problem("unauthorized", detail), {"WWW-Authenticate": challenge})


def _refuse_other_sites(headers: Headers, allowed: frozenset[str]) -> None:
    """Refuse what a page of another site has a browser on this machine send.

    A server that asks for no key because only this machine reaches it is reached by every
    page its user looks at: by a form sent across sites, or under a name that the page's
    owner has let point here.
    """
    host, origin = headers.get("host", ""), headers.get("origin")
    is_allowed = origin is None or origin in allowed or _is_own(origin)
    if not _is_own(f"//{host}") or not is_allowed:
        raise ProblemError(
            problem(
                "forbidden",
                "without API keys this server answers to names of this machine only; "
                "MESHCONE_REQUIRE_KEYS=always makes it ask for keys, and answer to any name",
            )
        )


def _is_own(url: str) -> bool:
    try:
        return is_loopback(urlsplit(url).hostname or "")
    except ValueError:
        return False
