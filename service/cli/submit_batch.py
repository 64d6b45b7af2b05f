"""``meshcone submit --batch``: all pairs of a document, done by a service."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from meshcone.errors import InputError, InternalError
from meshcone.json_text import DuplicateNameError, parse_json
from meshcone.local_files import read_bytes
from meshcone.outputs import require_places, write_together
from service.cli.telling import tell

JOB_TIMEOUT = 24 * 3600.0  # seconds; a queue may be long


def submit_batch(file: Path, server: str, report: Path | None) -> int:
    """Send a document of pairs, wait for the last of its jobs, and show the verdicts.

    Returns:
        The exit code, as of ``meshcone gate``.

    Raises:
        InputError: the document cannot be read, or the service refuses it.
        InternalError: the service does not answer, or jobs of the batch were deleted.
    """
    from service.cli.gate import exit_code_of, show_run
    from service.client.connection import connect, service_errors

    require_places([report], [file])
    document = _document(file)
    pairs = document.pop("pairs", None)
    if not isinstance(pairs, list):
        raise InputError("has no list 'pairs'", file=str(file))
    with connect(server) as client, service_errors():
        sent = client.submit_batch(pairs, document)
        tell(f"{server.rstrip('/')}{sent.links.self}", err=True)
        try:
            client.wait_for_batch(sent.id, timeout=JOB_TIMEOUT)
        except TimeoutError as error:
            raise InternalError(str(error)) from None
        run = client.batch_result(sent.id)
    if report is not None:
        write_together({report: run.model_dump_json(indent=2).encode() + b"\n"})
    show_run(run)
    if len(run.assets) != sent.pairs:
        raise InternalError(
            f"the service tells of {len(run.assets)} of the {sent.pairs} pairs that were sent: "
            "jobs of the batch were deleted meanwhile"
        )
    return exit_code_of(run)


def _document(file: Path) -> dict[str, Any]:
    try:
        document = parse_json(read_bytes(file))
    except DuplicateNameError as error:
        raise InputError(str(error), file=str(file)) from None
    except (ValueError, RecursionError):
        raise InputError("is not valid JSON", file=str(file)) from None
    if not isinstance(document, dict):
        raise InputError("is not a JSON object", file=str(file))
    return document
