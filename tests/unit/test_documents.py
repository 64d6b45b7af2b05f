"""The tables in docs/ are those of the code."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import get_args, get_origin

import pytest
from pydantic import BaseModel

from meshcone.assets import Limits
from meshcone.auditing.records import AssetAudit, Changes
from meshcone.auditing.records.changes import ChangeCounts
from meshcone.auditing.validator import ValidatorSettings
from meshcone.gates.rules import BOUNDS, GateRule
from meshcone.notices import Code
from meshcone.options import Options
from meshcone.quality.records import Metrics, Validity
from service.settings import ServiceSettings

DOCS = Path(__file__).parents[2] / "docs"


def option_rows(model: type[BaseModel], prefix: str = "") -> Iterator[str]:
    for name, field in model.model_fields.items():
        section = section_of(field.annotation)
        if section is None or field.default is None:
            default = "–" if field.default is None else f"`{json.dumps(field.default)}`"  # noqa: RUF001
            yield f"| `{prefix}{name}` | {default} | {field.description} |"
        if section is not None:
            yield from option_rows(section, f"{prefix}{name}.")


def section_of(annotation: object) -> type[BaseModel] | None:
    """The model an option is, or can be; a table's entries are documented elsewhere."""
    if get_origin(annotation) is dict:
        return None
    for kind in (annotation, *get_args(annotation)):
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            return kind
    return None


def setting_rows(model: type[BaseModel], prefix: str) -> Iterator[str]:
    for name, field in model.model_fields.items():
        default = "–" if field.default is None else f"`{field.default}`"  # noqa: RUF001
        yield f"| `{prefix}{name.upper()}` | {default} | {field.description} |"


@pytest.mark.parametrize("row", list(option_rows(Options)))
def test_every_option_is_documented_with_its_default(row: str) -> None:
    assert row in (DOCS / "options.md").read_text().splitlines()


@pytest.mark.parametrize("code", list(Code))
def test_every_warning_is_documented(code: Code) -> None:
    assert f"| `{code}` | {code.meaning} |" in (DOCS / "warnings.md").read_text().splitlines()


@pytest.mark.parametrize(
    "row",
    [
        *setting_rows(ServiceSettings, "MESHCONE_"),
        *setting_rows(Limits, "MESHCONE_LIMIT_"),
        *setting_rows(ValidatorSettings, "MESHCONE_"),
    ],
)
def test_every_setting_is_documented_with_its_default(row: str) -> None:
    assert row in (DOCS / "deployment.md").read_text().splitlines()


@pytest.mark.parametrize("name", [*Metrics.model_fields, *Validity.model_fields])
def test_every_metric_is_defined(name: str) -> None:
    assert f"`{name}" in (DOCS / "metrics.md").read_text()


@pytest.mark.parametrize("name", BOUNDS)
def test_every_bound_of_a_gate_is_documented(name: str) -> None:
    row = f"| `{name}` | {GateRule.model_fields[name].description} |"

    assert row in (DOCS / "gates.md").read_text().splitlines()


@pytest.mark.parametrize("family", AssetAudit.model_fields)
def test_every_value_of_an_audit_is_documented(family: str) -> None:
    text = (DOCS / "audit.md").read_text()
    section = text.partition(f"| `asset.{family}.` | |")[2].partition("\n## ")[0]

    record = AssetAudit.model_fields[family].annotation
    assert isinstance(record, type)
    assert issubclass(record, BaseModel)
    assert [name for name in record.model_fields if f"`{name}`" not in section] == []


@pytest.mark.parametrize("name", [*Changes.model_fields, *ChangeCounts.model_fields])
def test_every_kind_of_change_is_documented(name: str) -> None:
    assert f"`{name}`" in (DOCS / "audit.md").read_text().partition("## What changed")[2]
