"""``meshcone openapi``: the API's description as a file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from meshcone.outputs import write_together
from meshcone.places import is_file


def command(
    out: Annotated[Path, typer.Option("-o", "--out", help="File to write.")] = Path(
        "openapi/openapi.json"
    ),
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; exit 1 if the file is not current.")
    ] = False,
) -> int:
    """Write the API's OpenAPI document."""
    document = describe_api()
    if not check:
        write_together({out: document})
        return 0
    if is_file(out) and out.read_bytes() == document:
        return 0
    typer.echo(f"meshcone: {out} is not current; write it with `meshcone openapi`", err=True)
    return 1


def describe_api() -> bytes:
    """The OpenAPI document, the same bytes for the same code."""
    from service.api.app import create_app
    from service.settings import ServiceSettings

    document = create_app(ServiceSettings()).openapi()
    return (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode()
