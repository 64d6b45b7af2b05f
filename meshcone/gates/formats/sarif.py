"""SARIF 2.1.0 (OASIS standard): a result for each bound not passed and for each warning.

Section numbers are those of the standard.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from pathlib import PurePath
from typing import Any
from urllib.parse import quote

from meshcone.gates.records import GateCheck
from meshcone.gates.results import NO_GATE, AssetResult, GateRun
from meshcone.gates.words import name_of
from meshcone.notices import Code, WarningRecord, meaning_of

SCHEMA = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)
_SCHEMES = ("https://", "http://", "s3://")  # of files that a service has fetched
_WARNS = {"level": "warning"}
UNUSABLE = "unusable-file"  # rule of files that could not be read


def to_sarif(run: GateRun) -> bytes:
    """Write a run as a SARIF log; paths that are not absolute are under ``%SRCROOT%``."""
    rules = _rules(run.assets)
    ids = [rule["id"] for rule in rules]
    # Each file once (3.14.15), in the order of the assets; several can be of one file.
    files = list(dict.fromkeys(asset.source for asset in run.assets))
    places = {file: index for index, file in enumerate(files)}
    log = {
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [
            {
                "tool": {"driver": {"name": "MeshCone", "version": run.version, "rules": rules}},
                # What tells this run from others of the same files; after the last slash would
                # be what tells it from earlier ones (3.17.2).
                **({} if run.label is None else {"automationDetails": {"id": f"{run.label}/"}}),
                "invocations": [_invocation(run)],
                "artifacts": [
                    {"location": _location(file), "roles": ["analysisTarget"]} for file in files
                ],
                "results": [
                    result
                    for asset in run.assets
                    for result in _results(asset, places[asset.source], ids)
                ],
                "columnKind": "utf16CodeUnits",
            }
        ],
    }
    return json.dumps(log, indent=2, ensure_ascii=False).encode() + b"\n"


def _rules(assets: Sequence[AssetResult]) -> list[dict[str, Any]]:
    """Describe every check made, whether it found something or not (3.19.23)."""
    checks = {check.rule: check for asset in assets for check in asset.checks()}
    rules = [_rule(each.rule, f"{name_of(each.key)}, '{each.bound}'") for each in checks.values()]
    told = sorted(
        {each.code for asset in assets for each in asset.warnings}
        | {Code.GATES_NONE for asset in assets if asset.is_ungated}
    )
    rules += [_rule(code, meaning_of(code), "warning") for code in told]
    if any(_is_unusable(asset) for asset in assets):
        rules.append(_rule(UNUSABLE, "the file cannot be used"))
    return rules


def _rule(identifier: str, description: str, level: str = "error") -> dict[str, Any]:
    return {
        "id": identifier,
        "shortDescription": {"text": description},
        "defaultConfiguration": {"level": level},
    }


def _results(asset: AssetResult, index: int, ids: Sequence[str]) -> Iterable[dict[str, Any]]:
    for check in asset.checks():
        if check.status != "pass":
            yield {
                **_result(asset, index, ids, check.rule, check.words),
                # Only what failed has a level (3.27.10); `open` is undecided (3.27.9).
                "kind": "fail" if check.status == "fail" else "open",
                "level": check.severity if check.status == "fail" else "none",
                "properties": _properties(check),
            }
    for warning in asset.warnings:
        identity = f"{warning.code}\n{warning.side}\n{warning.where}"
        yield {
            **_result(asset, index, ids, warning.code, warning.words, identity),
            # That nothing was decided is no finding in the file: see above.
            **({"kind": "open", "level": "none"} if _is_of_ungated(warning) else _WARNS),
            "properties": warning.model_dump(include={"side", "where"}, exclude_none=True),
        }
    if asset.is_ungated and not any(map(_is_of_ungated, asset.warnings)):
        found = _result(asset, index, ids, Code.GATES_NONE, NO_GATE)
        yield {**found, "kind": "open", "level": "none"}
    if asset.error is not None and _is_unusable(asset):
        yield {**_result(asset, index, ids, UNUSABLE, asset.error.message), "level": "error"}


def _result(
    asset: AssetResult,
    index: int,
    ids: Sequence[str],
    rule: str,
    words: str,
    identity: str | None = None,
) -> dict[str, Any]:
    location = {**_location(asset.source), "index": index}
    # A mesh has no lines, but viewers that know source files only show nothing without one.
    place = {"artifactLocation": location, "region": {"startLine": 1}}
    fingerprint = hashlib.sha256(f"{asset.name}\n{identity or rule}".encode()).hexdigest()
    return {
        "ruleId": rule,
        "ruleIndex": ids.index(rule),
        "message": {"text": f"{asset.name}: {words}"},
        "locations": [{"physicalLocation": place}],
        "partialFingerprints": {"assetAndRule/v1": fingerprint},
    }


def _properties(check: GateCheck) -> dict[str, Any]:
    values = check.model_dump(mode="json", include={"value", "limit", "allowed", "position"})
    return {name: value for name, value in values.items() if value is not None}


def _invocation(run: GateRun) -> dict[str, Any]:
    """Say whether the run itself succeeded; its own faults are no findings in a file (3.20.14)."""
    notifications = [
        {
            "level": "error",
            "message": {"text": f"{asset.name}: {asset.error.message}"},
            "locations": [{"physicalLocation": {"artifactLocation": _location(asset.source)}}],
        }
        for asset in run.internal_errors()
        if asset.error is not None
    ]
    return {
        "executionSuccessful": not notifications,
        "toolExecutionNotifications": notifications,
    }


def _is_of_ungated(warning: WarningRecord) -> bool:
    return warning.code == Code.GATES_NONE


def _is_unusable(asset: AssetResult) -> bool:
    return asset.error is not None and asset.error.kind != "internal"


def _location(source: str) -> dict[str, Any]:
    if source.startswith(_SCHEMES):
        return {"uri": source}
    path = PurePath(source)
    if path.is_absolute():
        return {"uri": path.as_uri()}
    return {"uri": quote(path.as_posix()), "uriBaseId": "%SRCROOT%"}
