"""The tables in docs/ are those of the code."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

import pytest
from pydantic import BaseModel

from meshcone.assets import Limits
from meshcone.auditing.records import AssetAudit, Changes
from meshcone.auditing.records.changes import ChangeCounts
from meshcone.auditing.validator import ValidatorSettings
from meshcone.gates.paths import known_values
from meshcone.options import Mode
from meshcone.quality.records import Metrics, Validity
from meshcone.report.report import Agreement, AuditReport, MeasureReport, Outcome, Report
from service.cli import command_line, keys
from service.settings import ServiceSettings
from tests.references.parts import DOCS, PARTS, parts_of, renewed

DOCUMENTS = sorted(DOCS.glob("*.md"))
PARTS_OF_THE_TREE = ("meshcone", "service", "worker", "tests", "benchmarks", "examples")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.stem)
def test_what_the_code_says_is_what_a_document_has_of_it(document: Path) -> None:
    text = document.read_text()

    assert renewed(text) == text, "write it with `python -m tests.references`"


def test_every_part_stands_in_one_document() -> None:
    found = [name for document in DOCUMENTS for name in parts_of(document.read_text())]

    assert sorted(found) == sorted(PARTS)


@pytest.mark.parametrize(
    "row",
    [
        "| `seed` | `0` | whole number, 0 to 2,147,483,647 | seed of every sampling |",
        "| `within` | – | text of up to 40 characters |",  # noqa: RUF001
        '| `effort` | `"best"` | `fast`, `best` |',
        "| `cones.edge_cap.length.relative` | – | number, 1e-9 to 1,000,000 |",  # noqa: RUF001
        "| `cones.pin.boundary` | `false` | true, false | vertices on open borders |",
        "| `keep` | `[]` | list of up to 7: `uvs`, `materials`,",
    ],
)
def test_an_option_is_shown_with_its_default_and_what_it_can_be(row: str) -> None:
    assert any(line.startswith(row) for line in PARTS["options"]())


def test_every_setting_stands_with_one_process() -> None:
    shown = re.findall(r"^\| `(MESHCONE_\w+)`", (DOCS / "deployment.md").read_text(), re.MULTILINE)

    named = [
        *(f"MESHCONE_{name.upper()}" for name in ServiceSettings.model_fields),
        *(f"MESHCONE_{name.upper()}" for name in ValidatorSettings.model_fields),
        *(f"MESHCONE_LIMIT_{name.upper()}" for name in Limits.model_fields),
    ]
    assert sorted(shown) == sorted(named)


@pytest.mark.parametrize("mode", ["refine", "measure", "audit"])
def test_every_value_that_a_gate_can_name_is_described(mode: Mode) -> None:
    shown = set(re.findall(r"^\| `([^`]+)` \|", (DOCS / "values.md").read_text(), re.MULTILINE))

    for name in known_values(mode):
        if name.startswith(("options.", "warnings.", "quality.conventions.")):
            continue  # options.md, warnings.md and metrics.md have them
        short = re.sub(r"^quality\.(input|refined|floor|baselines\.\w+)\.", "", name)
        short = re.sub(r"^asset\.(source|refined|reference)\.", "asset.", short)
        assert {short, short.replace("inputs.reference", "inputs.source")} & shown


def test_every_command_is_described() -> None:
    text = (DOCS / "command-line.md").read_text()

    for command in [*command_line().registered_commands, *keys.commands.registered_commands]:
        assert re.search(rf"^## meshcone (keys )?{command.name}$", text, re.MULTILINE)


@pytest.mark.parametrize("name", [*Metrics.model_fields, *Validity.model_fields])
def test_every_metric_is_defined(name: str) -> None:
    assert f"`{name}" in (DOCS / "metrics.md").read_text()


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


@pytest.mark.parametrize("report", [Report, MeasureReport, AuditReport])
def test_every_section_of_a_report_is_described(report: type[BaseModel]) -> None:
    text = (DOCS / "report.md").read_text()

    names = [field.alias or name for name, field in report.model_fields.items()]
    assert [name for name in names if f"`{name}`" not in text] == []


@pytest.mark.parametrize("outcome", sorted({*get_args(Outcome), *get_args(Agreement)}))
def test_every_outcome_is_named_where_reports_are_described(outcome: str) -> None:
    assert f"`{outcome}`" in (DOCS / "report.md").read_text()


@pytest.mark.parametrize("package", ["meshcone", "service", "worker"])
def test_every_room_and_every_module_beside_the_rooms_is_named(package: str) -> None:
    text = (DOCS / "architecture.md").read_text()
    folder = DOCS.parent / package

    rooms = {f"{path.parent.name}/" for path in folder.glob("*/**/__init__.py")}
    modules = {path.name for path in folder.glob("*.py")} - {"__init__.py"}
    assert [name for name in sorted(rooms | modules) if name not in text] == []


@pytest.mark.parametrize("document", ["CONTRIBUTING.md", "docs/architecture.md"])
def test_the_modules_that_a_page_names_are_there(document: str) -> None:
    root = DOCS.parent
    named = set(re.findall(r"`((?:[\w-]+/)*\w+\.py)`", (root / document).read_text()))

    assert named
    places = {path.as_posix() for part in PARTS_OF_THE_TREE for path in (root / part).rglob("*.py")}
    assert [name for name in sorted(named) if not any(p.endswith(f"/{name}") for p in places)] == []
