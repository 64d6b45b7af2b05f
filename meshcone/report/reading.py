"""Reading a report of this version or an earlier one."""

from __future__ import annotations

import json

from meshcone.json_text import parse_json
from meshcone.report.report import SCHEMA, Report

_FIRST = "meshcone.report/1"
READABLE = (_FIRST, SCHEMA)


def parse_report(data: bytes) -> Report:
    """Read the report of a refinement; what its version did not have is absent.

    Raises:
        ValueError: it is no report of a refinement.
    """
    document = parse_json(data)
    if not isinstance(document, dict) or document.get("schema") != _FIRST:
        return Report.model_validate_json(data)
    return Report.model_validate_json(json.dumps({**document, "schema": SCHEMA}))
