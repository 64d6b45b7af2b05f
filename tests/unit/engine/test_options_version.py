"""Options that come need a new version: an older worker must not run a job that sets them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any

from meshcone.options import OPTIONS_VERSION, Options

KNOWN = {
    1: "3befeaf7ea47b92a",
    2: "dfeb42f1a821c51b",
    3: "1f30aaa72e64bdf0",
    4: "1800547e2e9e3c29",
    5: "73aa4ce0b142c94e",
    6: "283e722d75e33142",
    7: "ece6a8a17ca2ec52",
    8: "3ff7331c4d6ed4cf",
    9: "37d64d4f4d9057f1",
    10: "954ed34cffa42578",
    11: "21dfe0e88251b362",
    12: "785a9fe2125b569b",
}


def test_the_version_goes_up_with_each_new_option() -> None:
    names = sorted(names_in(Options.model_json_schema()))
    digest = hashlib.sha256("\n".join(names).encode()).hexdigest()[:16]

    assert KNOWN[OPTIONS_VERSION] == digest, (
        "options were added or removed: raise OPTIONS_VERSION in meshcone/options/version.py "
        f"and enter {digest!r} for it here"
    )


def names_in(schema: dict[str, Any]) -> Iterator[str]:
    for model, definition in {"": schema, **schema["$defs"]}.items():
        yield from (f"{model}.{name}" for name in definition.get("properties", {}))
