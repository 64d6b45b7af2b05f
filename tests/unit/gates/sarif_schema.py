"""The part of SARIF 2.1.0 that is written here, as a JSON Schema, from the standard's text.

Every object is closed: a property that is not listed here is either not SARIF's or has to be
looked up in the standard (OASIS, sarif-v2.1.0-errata01) and added with its section.
"""

from __future__ import annotations

from typing import Any

Schema = dict[str, Any]


def closed(required: list[str], **properties: Schema) -> Schema:
    return {
        "type": "object",
        "required": required,
        "properties": properties,
        "additionalProperties": False,
    }


def many(items: Schema, *, unique: bool = False, least: int = 0) -> Schema:
    return {"type": "array", "items": items, "uniqueItems": unique, "minItems": least}


TEXT = {"type": "string"}
FROM_0 = {"type": "integer", "minimum": 0}
LEVEL = {"enum": ["none", "note", "warning", "error"]}  # 3.27.10
BAG = {"type": "object"}  # 3.8
MESSAGE = closed(["text"], text=TEXT)  # 3.11
LOCATION = closed(  # 3.4
    ["uri"],
    uri={"type": "string", "format": "uri-reference"},
    uriBaseId=TEXT,
    index=FROM_0,
)
REGION = closed([], startLine={"type": "integer", "minimum": 1})  # 3.30.5
PLACE = closed(  # 3.28, 3.29
    ["physicalLocation"],
    physicalLocation=closed(["artifactLocation"], artifactLocation=LOCATION, region=REGION),
)
RULE = closed(  # 3.49, 3.50
    ["id"],
    id=TEXT,
    shortDescription=MESSAGE,
    defaultConfiguration=closed([], level=LEVEL),
)
NOTIFICATION = closed(["message"], level=LEVEL, message=MESSAGE, locations=many(PLACE))  # 3.58
INVOCATION = closed(  # 3.20
    ["executionSuccessful"],
    executionSuccessful={"type": "boolean"},
    toolExecutionNotifications=many(NOTIFICATION),
)
ROLES = ["analysisTarget", "attachment", "responseFile", "resultFile"]  # 3.24.6, of more
ARTIFACT = closed(  # 3.24
    ["location"], location=LOCATION, roles=many({"enum": ROLES}, unique=True)
)
RESULT: Schema = {  # 3.27
    **closed(
        ["ruleId", "message"],  # 3.27.5: where there is no rule object
        ruleId=TEXT,
        ruleIndex=FROM_0,
        kind={"enum": ["notApplicable", "pass", "fail", "review", "open", "informational"]},
        level=LEVEL,
        message=MESSAGE,
        locations=many(PLACE),
        partialFingerprints={"type": "object", "additionalProperties": TEXT},
        properties=BAG,
    ),
    # 3.27.10: what did not fail has the level none.
    "if": {"properties": {"kind": {"not": {"const": "fail"}}}, "required": ["kind"]},
    "then": {"properties": {"level": {"const": "none"}}, "required": ["level"]},
}
RUN = closed(  # 3.14
    ["tool"],
    tool=closed(  # 3.18, 3.19
        ["driver"],
        driver=closed(["name"], name=TEXT, version=TEXT, rules=many(RULE, unique=True)),
    ),
    automationDetails=closed([], id=TEXT),  # 3.17, 3.17.2
    invocations=many(INVOCATION),
    artifacts=many(ARTIFACT, unique=True),
    results=many(RESULT),
    columnKind={"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
)
LOG = {  # 3.13
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    **closed(
        ["version", "runs"],
        **{"$schema": {"type": "string", "format": "uri"}},
        version={"const": "2.1.0"},
        runs=many(RUN),
    ),
}
