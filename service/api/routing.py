"""Routers of the API: what all of its routes have in common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, get_origin

from fastapi import APIRouter, Depends, Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute
from pydantic.json_schema import SkipJsonSchema

from service.problems import ProblemError, problem

Absent = SkipJsonSchema[None]
"""None where a parameter is left out; a parameter that is there cannot be null."""


class HeadRouter(APIRouter):
    """A router that answers HEAD wherever it answers GET (RFC 9110, section 9.3.2).

    The server sends the same headers and leaves the content out. OpenAPI describes the GET alone.
    """

    def add_api_route(
        self,
        path: str,
        endpoint: Callable[..., Any],
        *,
        methods: set[str] | list[str] | None = None,
        include_in_schema: bool = True,
        **settings: Any,
    ) -> None:
        """Register a route, and its HEAD."""
        super().add_api_route(
            path, endpoint, methods=methods, include_in_schema=include_in_schema, **settings
        )
        if methods is not None and set(methods) == {"GET"}:
            super().add_api_route(
                path, endpoint, methods=["HEAD"], include_in_schema=False, **settings
            )


class ResourceRouter(HeadRouter):
    """A router of resources: it refuses query parameters that a call would ignore."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(dependencies=[Depends(_require_heeded_parameters)], **settings)


async def _require_heeded_parameters(request: Request) -> None:
    """Refuse what would be ignored: a misspelled filter would select everything.

    Raises:
        ProblemError: naming the parameters there are, or the one that is there more than once.
    """
    if not request.query_params:
        return
    route: APIRoute = request.scope["route"]
    known = _query_names(route.dependant)
    for name, count in Counter(key for key, _ in request.query_params.multi_items()).items():
        if name not in known:
            there_are = f"there are {', '.join(sorted(known))}" if known else "there is none here"
            raise ProblemError(problem("input", f"unknown query parameter '{name}'; {there_are}"))
        if count > 1 and not known[name]:
            detail = f"query parameter '{name}' is there {count} times; send it once"
            raise ProblemError(problem("input", detail))


def _query_names(dependant: Dependant) -> dict[str, bool]:
    """The parameters of a call, and of each whether it may be repeated."""
    names = {
        str(field.alias): get_origin(field.field_info.annotation) is list
        for field in dependant.query_params
    }
    for each in dependant.dependencies:
        names |= _query_names(each)
    return names
