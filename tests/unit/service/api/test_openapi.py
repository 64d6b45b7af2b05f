from __future__ import annotations

import json
from pathlib import Path

from service.cli.openapi import describe_api

COMMITTED = Path(__file__).parents[4] / "openapi" / "openapi.json"


def test_the_committed_description_is_the_applications() -> None:
    assert COMMITTED.read_bytes() == describe_api(), "write it with `meshcone openapi`"


def test_it_is_the_same_every_time() -> None:
    assert describe_api() == describe_api()


def test_every_reference_in_it_leads_somewhere() -> None:
    document = json.loads(describe_api())
    schemas = document["components"]["schemas"]

    for reference in references(document):
        assert reference.removeprefix("#/components/schemas/") in schemas


def references(node: object) -> list[str]:
    if isinstance(node, list):
        return [found for item in node for found in references(item)]
    if not isinstance(node, dict):
        return []
    own = [node["$ref"]] if isinstance(node.get("$ref"), str) else []
    return own + [found for item in node.values() for found in references(item)]
