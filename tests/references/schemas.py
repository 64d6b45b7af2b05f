"""Options, settings, bounds, warnings and problems, as their models and enumerations state them."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel

from meshcone.gates.rules import BOUNDS, GateRule
from meshcone.notices import Code
from meshcone.options import Options
from service.problems import PROBLEM_TYPES
from service.settings import ServiceSettings
from tests.references.tables import NONE, table
from worker.transfers.settings import TransferSettings
from worker.webhooks.settings import WebhookSettings


def options() -> Iterator[str]:
    """Every option, with what it can be."""
    schema = Options.model_json_schema()
    rows = _options(schema, schema, "")
    yield from table(("key", "default", "can be", "meaning"), rows)


def _options(
    section: Mapping[str, Any], schema: Mapping[str, Any], prefix: str
) -> Iterator[tuple[str, ...]]:
    for name, field in section["properties"].items():
        inner = _section_of(field, schema)
        default = field.get("default")
        if inner is None or (default is None and "description" in field):
            shown = NONE if default is None else f"`{json.dumps(default)}`"
            kinds = "a table" if inner else _can_be(field, schema)
            yield f"`{prefix}{name}`", shown, kinds, field["description"]
        if inner is not None:
            yield from _options(inner, schema, f"{prefix}{name}.")


def _section_of(field: Mapping[str, Any], schema: Mapping[str, Any]) -> Mapping[str, Any] | None:
    for kind in (field, *field.get("anyOf", ())):
        resolved = _resolved(kind, schema)
        if "properties" in resolved:
            return resolved
    return None


def _resolved(field: Mapping[str, Any], schema: Mapping[str, Any]) -> Mapping[str, Any]:
    if "$ref" not in field:
        return field
    found: Mapping[str, Any] = schema["$defs"][field["$ref"].rpartition("/")[2]]
    return found


def _can_be(field: Mapping[str, Any], schema: Mapping[str, Any]) -> str:
    """What a value can be, by its JSON schema."""
    field = _resolved(field, schema)
    if "anyOf" in field:
        kinds = [_can_be(each, schema) for each in field["anyOf"] if each.get("type") != "null"]
        return " or ".join(dict.fromkeys(kinds))
    if "const" in field:
        return f"`{field['const']}`"
    if "enum" in field:
        return ", ".join(f"`{word}`" for word in field["enum"])
    kind = field.get("type")
    if kind == "array":
        length = _between(field.get("minItems"), field.get("maxItems"))
        each = _can_be(field["items"], schema)
        return f"list of {length}: {each}" if length else f"list of {each}"
    if kind == "boolean":
        return "true, false"
    if kind == "integer":
        return f"whole number{_range(field)}"
    if kind == "number":
        return f"number{_range(field)}"
    if kind == "object":
        return "a table"
    length = field.get("maxLength")
    return "text" if length is None else f"text of up to {length:,} characters"


def _range(field: Mapping[str, Any]) -> str:
    least, most = field.get("minimum"), field.get("maximum")
    above = field.get("exclusiveMinimum")
    if least is not None and most is not None:
        return f", {_number(least)} to {_number(most)}"
    if above is not None:
        return f" above {_number(above)}" + ("" if most is None else f", up to {_number(most)}")
    return f" from {_number(least)}" if least is not None else ""


def _between(least: int | None, most: int | None) -> str:
    if most is None:
        return ""
    return f"{least} to {most}" if least else f"up to {most}"


def _number(value: float) -> str:
    if value and not 1e-3 <= abs(value) < 1e9 and isinstance(value, float):
        return re.sub(r"e([-+])0?", lambda sign: "e-" if sign[1] == "-" else "e", f"{value:g}")
    return f"{value:,g}" if isinstance(value, float) and value % 1 else f"{int(value):,}"


def settings(
    model: type[BaseModel], prefix: str = "MESHCONE_", beside: type[BaseModel] | None = None
) -> Iterator[str]:
    """What an operator can set, but for what another model has as well."""
    schema = model.model_json_schema()
    known = set() if beside is None else set(beside.model_fields)

    def rows() -> Iterator[tuple[str, ...]]:
        for name, field in model.model_fields.items():
            if name not in known:
                default = NONE if field.default in (None, ()) else f"`{_shown(field.default)}`"
                kinds = _can_be(schema["properties"][name], schema)
                yield f"`{prefix}{name.upper()}`", default, kinds, str(field.description)

    yield from table(("variable", "default", "can be", "meaning"), rows())


def _shown(default: Any) -> str:
    return str(default).lower() if isinstance(default, bool) else str(default)


def of_the_front_end() -> Iterator[str]:
    """The settings that the HTTP front end has beside those of the others."""

    class Others(WebhookSettings, TransferSettings):
        """What the other processes read."""

    return settings(ServiceSettings, beside=Others)


def warnings() -> Iterator[str]:
    """Every warning."""
    yield from table(("code", "what it says"), ((f"`{code}`", code.meaning) for code in Code))


def problems() -> Iterator[str]:
    """Every kind of problem."""
    rows = (
        (f"`{name}`", str(each.status), f"`{each.kind}`", each.title)
        for name, each in PROBLEM_TYPES.items()
    )
    yield from table(("name", "status", "kind", "title"), rows)


def bounds() -> Iterator[str]:
    """Every bound that a gate can have."""
    rows = ((f"`{name}`", str(GateRule.model_fields[name].description)) for name in BOUNDS)
    yield from table(("bound", "allows"), rows)
