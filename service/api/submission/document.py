"""The JSON document that submits a job whose files are named, not sent."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from fastapi import Request
from pydantic import ValidationError

from meshcone.errors import InputError, LimitError
from meshcone.json_text import DuplicateNameError, parse_json
from meshcone.options import Options, parse_options
from meshcone.suggestions import first_cause, in_words
from service.api.request_schemas import JobRequest
from service.api.submission.parts import (
    OPTIONS_BYTES,
    RESOURCE_FIELDS,
    SubmittedForm,
    named_file,
    submission_of,
    too_long,
)
from service.settings import ServiceSettings

# Of a file, which may be either of two things, the names of our classes say nothing.
_UNTOLD = ("NamedBlob", "LinkedFile", "[key]")
DOCUMENT_BYTES = 1024 * 1024  # all of it is held in memory; a URL has up to 2 KB


async def read_document(request: Request, settings: ServiceSettings) -> SubmittedForm:
    """The job that a request's JSON describes.

    Raises:
        InputError: it is no such document, or a part of it cannot be used.
        LimitError: it is too long, or has too many files.
    """
    return submission_in(_parsed(await _bounded(request)), settings)


def submission_in(
    document: Any,
    settings: ServiceSettings,
    parse: Callable[[dict[str, Any]], Options] = parse_options,
) -> SubmittedForm:
    """The job that a JSON value describes; raises as :func:`read_document` does."""
    try:
        job = JobRequest.model_validate(document)
    except ValidationError as error:
        raise InputError(_words(error)) from None
    if _length(job.options) > OPTIONS_BYTES:
        raise too_long("options are longer")
    return submission_of(
        source=named_file("source", job.source, settings),
        reference=(
            None if job.reference is None else named_file("reference", job.reference, settings)
        ),
        resources={
            field: tuple(named_file(field, file, settings) for file in getattr(job, field))
            for field in RESOURCE_FIELDS
        },
        options=job.options,
        labels=job.labels,
        webhook=job.webhook,
        outputs=job.outputs,
        settings=settings,
        parse=parse,
    )


async def _bounded(request: Request) -> bytes:
    text = bytearray()
    async for chunk in request.stream():
        text += chunk
        if len(text) > DOCUMENT_BYTES:
            raise LimitError(
                f"the JSON is longer than the {DOCUMENT_BYTES} bytes accepted here: name files, "
                "and send those of this machine as a form or by PUT /v1/blobs"
            )
    return bytes(text)


def _parsed(text: bytes) -> Any:
    try:
        return parse_json(text)
    except DuplicateNameError as error:
        raise InputError(str(error)) from None
    except (ValueError, RecursionError):
        raise InputError("the request is not valid JSON") from None


def _length(options: dict[str, Any]) -> int:
    try:
        return len(json.dumps(options))
    except RecursionError:
        raise InputError("options are nested too deeply") from None


def _words(error: ValidationError) -> str:
    cause = first_cause(error)
    path = ".".join(str(part) for part in cause["loc"] if part not in _UNTOLD)
    if cause["type"] == "extra_forbidden":
        known = ", ".join(JobRequest.model_fields)
        if len(cause["loc"]) == 1:
            return f"unknown field '{path}'; the fields are {known}"
        return f"unknown field '{path}'"
    return f"field '{path}': {in_words(cause)}" if path else in_words(cause)
