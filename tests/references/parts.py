"""The parts of docs/ that the code says, made of the code.

A part stands between ``<!-- made: NAME -->`` and ``<!-- end -->``. ``python -m tests.references``
writes all of them, and ``tests/unit/test_documents.py`` compares.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from meshcone.assets import Limits
from meshcone.auditing.validator import ValidatorSettings
from tests.references.commands import commands
from tests.references.schemas import (
    bounds,
    of_the_front_end,
    options,
    problems,
    settings,
    warnings,
)
from tests.references.values import values
from worker.settings import WorkerSettings
from worker.transfers.settings import TransferSettings
from worker.webhooks.settings import WebhookSettings

DOCS = Path(__file__).parents[2] / "docs"
_PART = re.compile(r"(<!-- made: ([\w ]+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)

PARTS: Mapping[str, Callable[[], Iterator[str]]] = {
    "options": options,
    "settings of every process": lambda: settings(WorkerSettings),
    "settings of webhooks": lambda: settings(WebhookSettings, beside=WorkerSettings),
    "settings of transfers": lambda: settings(TransferSettings, beside=WorkerSettings),
    "settings of the front end": of_the_front_end,
    "settings of the validator": lambda: settings(ValidatorSettings),
    "limits": lambda: settings(Limits, "MESHCONE_LIMIT_"),
    "warnings": warnings,
    "problems": problems,
    "bounds": bounds,
    "values": values,
    "commands": commands,
}


def parts_of(text: str) -> list[str]:
    """The names of the parts that a document has."""
    return [found[2] for found in _PART.finditer(text)]


def renewed(text: str) -> str:
    """A document whose parts are what the code says now."""

    def part(match: re.Match[str]) -> str:
        lines = "\n".join(PARTS[match[2]]())
        return f"{match[1]}\n{lines}\n\n{match[4]}"

    return _PART.sub(part, text)
