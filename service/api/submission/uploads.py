"""The multipart form, or the JSON document, that submits a job."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Any

from fastapi import Request
from pydantic import TypeAdapter, ValidationError
from starlette.datastructures import FormData, UploadFile

from meshcone.errors import InputError
from meshcone.json_text import DuplicateNameError, parse_json
from meshcone.options import read_options_json
from meshcone.suggestions import first_cause, in_words
from service.api.request_schemas import FileByName, OutputPlaces
from service.api.submission.document import read_document
from service.api.submission.multipart import MEDIA_TYPE, read_multipart, require_utf8
from service.api.submission.parts import (
    OPTIONS_BYTES,
    RESOURCE_FIELDS,
    AnyFile,
    SubmittedForm,
    Upload,
    file_name,
    named_file,
    submission_of,
    too_long,
)
from service.problems import ProblemError, problem
from service.settings import ServiceSettings

FIELDS = ("source", "reference", "options", *RESOURCE_FIELDS, "label", "webhook", "outputs")
_OUTPUTS: TypeAdapter[OutputPlaces] = TypeAdapter(OutputPlaces)
_FILE_BY_NAME: TypeAdapter[FileByName] = TypeAdapter(FileByName)


async def read_form(request: Request) -> AsyncIterator[SubmittedForm]:
    """The request's content, as a dependency; its temporary files are closed with the request.

    Raises:
        ProblemError: it is neither a multipart form nor JSON, or a form that was cut off.
        InputError: a field is missing, unknown, repeated or of the wrong kind.
        LimitError: it has too many files, or a field is too long.
    """
    content_type = request.headers.get("content-type", "")
    settings: ServiceSettings = request.app.state.settings
    media_type = content_type.partition(";")[0].strip().lower()
    if media_type == "application/json":
        yield await read_document(request, settings)
        return
    if media_type != MEDIA_TYPE:
        raise ProblemError(
            problem(
                "media-type",
                "send a multipart/form-data form (curl: -F source=@mesh.glb …), or "
                "application/json where every file is named by its URL or its hash",
            )
        )
    require_utf8(content_type)
    form = await read_multipart(request, settings)
    try:
        yield await _checked(form, settings)
    finally:
        await form.close()


async def _checked(form: FormData, settings: ServiceSettings) -> SubmittedForm:
    for name in form:
        if name not in FIELDS:
            raise InputError(f"unknown form field '{name}'; the fields are {', '.join(FIELDS)}")
    resources = {
        field: tuple(_file(field, value, settings) for value in form.getlist(field))
        for field in RESOURCE_FIELDS
    }
    source, reference = (_single(form, side) for side in ("source", "reference"))
    return submission_of(
        source=_file("source", source, settings),
        reference=None if reference is None else _file("reference", reference, settings),
        resources=resources,
        options=await _options(form),
        labels=_labels(form),
        webhook=_webhook(form),
        outputs=_outputs(form),
        settings=settings,
    )


def _single(form: FormData, name: str) -> UploadFile | str | None:
    values = form.getlist(name)
    if len(values) > 1:
        raise InputError(f"form field '{name}' is sent {len(values)} times; send it once")
    return values[0] if values else None


def _file(field: str, value: UploadFile | str | None, settings: ServiceSettings) -> AnyFile:
    if value is None:
        raise InputError(f"form field '{field}' is missing: send the mesh file in it")
    if isinstance(value, str):
        return named_file(field, _by_name(field, value), settings)
    return Upload(file_name(field, value.filename or ""), value.file, value.size or 0)


def _by_name(field: str, text: str) -> FileByName:
    try:
        _require_json(field, text)
        return _FILE_BY_NAME.validate_json(text)
    except (ValueError, RecursionError):
        raise InputError(
            f"form field '{field}' must be a file with a file name (curl: -F {field}=@mesh.glb), "
            'or {"name": "mesh.glb", "sha256": "..."} for one that was sent before, or '
            '{"url": "https://..."} for one that is to be fetched'
        ) from None


async def _options(form: FormData) -> dict[str, Any]:
    value = _single(form, "options")
    if value is None:
        return {}
    if isinstance(value, str):
        return read_options_json(value)
    if (value.size or 0) > OPTIONS_BYTES:
        raise too_long("options are longer")
    return read_options_json(await value.read())


def _labels(form: FormData) -> tuple[str, ...]:
    labels: list[str] = []
    for value in form.getlist("label"):
        if not isinstance(value, str):
            raise InputError("form field 'label' must be plain text, found a file")
        labels.append(value)
    return tuple(labels)


def _outputs(form: FormData) -> OutputPlaces:
    value = _single(form, "outputs")
    if value is None or value == "":
        return {}
    if not isinstance(value, str):
        raise InputError("form field 'outputs' must be plain text, found a file")
    try:
        _require_json("outputs", value)
        return _OUTPUTS.validate_json(value)
    except ValidationError as error:
        cause = first_cause(error)
        path = "".join(f".{part}" for part in cause["loc"] if part != "[key]")
        raise InputError(f"form field 'outputs{path}': {in_words(cause)}") from None
    except (ValueError, RecursionError):
        raise InputError("form field 'outputs' is not valid JSON") from None


def _require_json(field: str, text: str) -> None:
    """Refuse what a validator would read in silence: of two members of one name it takes the last.

    Raises:
        InputError: an object has a name twice.
        ValueError, RecursionError: the text is no JSON.
    """
    try:
        parse_json(text)
    except DuplicateNameError as error:
        raise InputError(f"form field '{field}': {error}") from None


def _webhook(form: FormData) -> str | None:
    value = _single(form, "webhook")
    if value is not None and not isinstance(value, str):
        raise InputError("form field 'webhook' must be plain text, found a file")
    return value
