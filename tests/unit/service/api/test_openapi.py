from __future__ import annotations

import json
import re
from pathlib import Path

from fastapi import FastAPI
from fastapi.routing import APIRoute

from service.cli.openapi import describe_api

COMMITTED = Path(__file__).parents[4] / "openapi" / "openapi.json"
_STATUS = re.compile(r"HTTP_(\d{3})_")


def test_the_committed_description_is_the_applications() -> None:
    assert COMMITTED.read_bytes() == describe_api(), "write it with `meshcone openapi`"


def test_it_is_the_same_every_time() -> None:
    assert describe_api() == describe_api()


def test_every_reference_in_it_leads_somewhere() -> None:
    document = json.loads(describe_api())
    schemas = document["components"]["schemas"]

    for reference in references(document):
        assert reference.removeprefix("#/components/schemas/") in schemas


def test_every_operation_has_a_name_of_its_own_that_a_program_can_have() -> None:
    paths = json.loads(describe_api())["paths"]
    names = [each["operationId"] for path in paths.values() for each in path.values()]

    assert {"submit_job", "list_jobs", "get_job", "get_source", "get_mesh"} <= set(names)
    assert len(names) == len(set(names))
    assert all(name.isidentifier() and name.islower() for name in names)


def test_no_parameter_is_described_as_null_or_as_a_list_that_is_a_header() -> None:
    paths = json.loads(describe_api())["paths"]
    parameters = [
        parameter
        for path in paths.values()
        for operation in path.values()
        for parameter in operation.get("parameters", ())
    ]

    assert all("anyOf" not in parameter["schema"] for parameter in parameters)
    headers = {each["name"]: each["schema"] for each in parameters if each["in"] == "header"}
    assert {schema["type"] for schema in headers.values()} == {"string"}
    assert "Prefer" in headers


def test_every_status_that_a_route_sets_is_described(app: FastAPI) -> None:
    paths = json.loads(describe_api())["paths"]
    for route in app.routes:
        if not isinstance(route, APIRoute) or not route.include_in_schema:
            continue
        names = route.endpoint.__code__.co_names  # as in status.HTTP_202_ACCEPTED
        sets = {int(each.group(1)) for each in map(_STATUS.match, names) if each}
        method = next(iter(route.methods)).lower()
        described = paths[route.path][method]["responses"]

        assert {str(status) for status in sets} <= described.keys(), route.path


def references(node: object) -> list[str]:
    if isinstance(node, list):
        return [found for item in node for found in references(item)]
    if not isinstance(node, dict):
        return []
    own = [node["$ref"]] if isinstance(node.get("$ref"), str) else []
    return own + [found for item in node.values() for found in references(item)]
