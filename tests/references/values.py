"""The values of a report, by the names that gates have for them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from meshcone.auditing.records import AssetAudit
from meshcone.gates.paths import Known, is_metric, known_values, side_of
from meshcone.gates.words import names_in_words
from meshcone.options import Mode
from meshcone.quality.records import Metrics
from meshcone.report.report import AuditReport, MeasureReport, Report
from tests.references.tables import table

_MODELS: Mapping[Mode, type[BaseModel]] = {
    "refine": Report,
    "measure": MeasureReport,
    "audit": AuditReport,
}
_KINDS = {
    "number": "number",
    "interval": "interval",
    "truth": "yes or no",
    "word": "word",
    "list": "words",
}


def values() -> Iterator[str]:
    """Every value, those of one section in a table of their own."""
    known = {mode: known_values(mode) for mode in _MODELS}
    names = dict.fromkeys(name for mode in _MODELS for name in known[mode])
    sections: dict[str, list[tuple[str, ...]]] = {}
    for name in names:
        if not _is_told_elsewhere(name):
            modes = [mode for mode in _MODELS if name in known[mode]]
            kind = _kind([known[mode][name] for mode in modes])
            of = "all" if len(modes) == len(_MODELS) else ", ".join(modes)
            row = (f"`{name}`", kind, _meaning(name), of)
            sections.setdefault(_section(name), []).append(row)
    for section, rows in sections.items():
        yield f"## {section}"
        yield ""
        yield from table(("name", "is", "meaning", "of"), iter(rows))
        yield ""


def _section(name: str) -> str:
    if is_metric(name):
        return "Metrics"
    first, _, rest = name.partition(".")
    return f"`{first}`" if rest else "The report itself"


def _is_told_elsewhere(name: str) -> bool:
    parts = name.split(".")
    if parts[0] == "asset":
        return side_of(name) is not None
    if parts[0] == "quality":
        return parts[1] in ("input", "refined", "floor", "baselines", "conventions")
    return (parts[0] in ("options", "warnings") and len(parts) > 1) or parts[:2] == [
        "inputs",
        "reference",
    ]


def _kind(known: list[Known]) -> str:
    choices = dict.fromkeys(choice for each in known for choice in each.choices)
    if known[0].kind == "word" and choices:
        return ", ".join(f"`{choice}`" for choice in choices)
    return _KINDS[known[0].kind]


def _meaning(name: str) -> str:
    for model in (*_MODELS.values(), Metrics):
        described = _description(model, name.split("."))
        if described:
            return described
    words = names_in_words().get(name)
    assert words is not None, f"{name} needs a description: Field(description=…)"
    return words


def _description(model: type[BaseModel], parts: list[str]) -> str | None:
    fields = {field.alias or own: field for own, field in model.model_fields.items()}
    if parts[0] == "asset":
        return _description(AssetAudit, parts[1:])
    if parts[0] not in fields:
        return None
    field = fields[parts[0]]
    rest = parts[1:]
    if not rest or rest == ["*"]:
        return field.description
    for inner in _models(field.annotation):
        found = _description(inner, rest[1:] if rest[0] == "*" else rest)
        if found:
            return found
    return None


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    elif get_origin(annotation) is not None:
        for each in get_args(annotation):
            yield from _models(each)
