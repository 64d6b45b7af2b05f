"""The multipart form that submits a job."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

from fastapi import Request
from pydantic import ValidationError
from python_multipart.multipart import parse_options_header
from starlette.datastructures import FormData, UploadFile
from starlette.exceptions import HTTPException

from meshcone.errors import InputError, LimitError
from meshcone.gates.fitting import require_known
from meshcone.options import Options, parse_options, read_options_json
from meshcone.relative_names import inside
from service.api.schemas import LABEL_LENGTH, NamedBlob
from service.problems import ProblemError, problem
from service.settings import ServiceSettings
from worker.outbound.addresses import require_url

_RESOURCE_FIELDS = ("source_resources", "reference_resources", "resources")
FIELDS = ("source", "reference", "options", *_RESOURCE_FIELDS, "label", "webhook")
NAME_LENGTH = 255  # characters; what common file systems allow
MAX_LABELS = 16
OPTIONS_BYTES = 64 * 1024  # kept in the broker's memory for as long as the job is known
_MESHES_AND_OPTIONS = 3  # any of them as a file or as a plain field


@dataclass(frozen=True)
class Upload:
    """A sent file, spooled to disk if it is large."""

    name: str
    file: BinaryIO
    size: int


@dataclass(frozen=True)
class SubmittedForm:
    """A form whose fields are sound; nothing is known yet of what is in the files."""

    source: Upload | NamedBlob
    reference: Upload | NamedBlob | None
    source_resources: tuple[Upload | NamedBlob, ...]
    reference_resources: tuple[Upload | NamedBlob, ...]
    resources: tuple[Upload | NamedBlob, ...]
    options: Options
    options_as_sent: dict[str, Any]
    labels: tuple[str, ...]
    webhook: str | None


async def read_form(request: Request) -> AsyncIterator[SubmittedForm]:
    """The request's form, as a dependency; its temporary files are closed with the request.

    Raises:
        ProblemError: it is no multipart form.
        InputError: a field is missing, unknown, repeated or of the wrong kind.
        LimitError: it has too many files, or a field is too long.
    """
    content_type = request.headers.get("content-type", "")
    if not content_type.startswith("multipart/form-data"):
        raise ProblemError(
            problem("media-type", "send a multipart/form-data form (curl: -F source=@mesh.glb …)")
        )
    # Other encodings can hold what is no text, or end in an error of their decoder's own.
    charset = parse_options_header(content_type)[1].get(b"charset", b"utf-8")
    if charset.lower() not in (b"utf-8", b"us-ascii"):
        raise ProblemError(problem("media-type", "send the form as UTF-8, without another charset"))
    settings: ServiceSettings = request.app.state.settings
    form = await _bounded_form(request, settings)
    try:
        yield await _checked(form, settings)
    finally:
        await form.close()


async def _bounded_form(request: Request, settings: ServiceSettings) -> FormData:
    try:
        return await request.form(
            max_files=settings.max_resources + _MESHES_AND_OPTIONS,
            max_fields=settings.max_resources + _MESHES_AND_OPTIONS + MAX_LABELS + 1,
            max_part_size=OPTIONS_BYTES,
        )
    except HTTPException as error:
        # The framework tells what is too much from what is broken by its words alone.
        if "exceeded maximum" in error.detail:
            raise _too_long("a text field of the form is longer") from None
        if error.detail.startswith("Too many"):
            raise LimitError(f"the form has more than is accepted here: {error.detail}") from None
        raise


async def _checked(form: FormData, settings: ServiceSettings) -> SubmittedForm:
    for name in form:
        if name not in FIELDS:
            raise InputError(f"unknown form field '{name}'; the fields are {', '.join(FIELDS)}")
    resources = {
        field: tuple(_file(field, value) for value in form.getlist(field))
        for field in _RESOURCE_FIELDS
    }
    count = sum(map(len, resources.values()))
    if count > settings.max_resources:
        raise LimitError(
            f"{count} resources are more than the {settings.max_resources} accepted here"
        )
    _require_distinct(resources)
    sent = await _options(form)
    options = _sound(parse_options(sent))
    _require_list(options, resources)
    source = _file("source", _single(form, "source"))
    reference = _reference(form, options, resources["reference_resources"])
    if reference is not None:
        options.gated_within(source.name, reference.name)  # refuses a tolerance that cannot be used
    return SubmittedForm(
        source=source,
        reference=reference,
        **resources,
        options=options,
        options_as_sent=sent,
        labels=_labels(form),
        webhook=_webhook(form, settings),
    )


def _single(form: FormData, name: str) -> UploadFile | str | None:
    values = form.getlist(name)
    if len(values) > 1:
        raise InputError(f"form field '{name}' is sent {len(values)} times; send it once")
    return values[0] if values else None


def _file(field: str, value: UploadFile | str | None) -> Upload | NamedBlob:
    if value is None:
        raise InputError(f"form field '{field}' is missing: send the mesh file in it")
    if isinstance(value, str):
        return _named_blob(field, value)
    name = _name(field, value.filename or "")
    if not name:
        raise InputError(f"the file in form field '{field}' has no name")
    return Upload(name, value.file, value.size or 0)


def _reference(
    form: FormData, options: Options, resources: tuple[Upload | NamedBlob, ...]
) -> Upload | NamedBlob | None:
    """The reference, which an audit can do without."""
    sent = _single(form, "reference")
    if sent is None and options.mode == "audit":
        if resources:
            raise InputError("form field 'reference_resources' is sent without a 'reference'")
        return None
    return _file("reference", sent)


def _named_blob(field: str, text: str) -> NamedBlob:
    try:
        blob = NamedBlob.model_validate_json(text)
    except ValidationError:
        raise InputError(
            f"form field '{field}' must be a file with a file name (curl: -F {field}=@mesh.glb), "
            'or {"name": "mesh.glb", "sha256": "..."} for one that was sent before'
        ) from None
    name = _name(field, blob.name)
    if not name:
        raise InputError(f"the file in form field '{field}' has no name")
    return blob.model_copy(update={"name": name})


def _name(field: str, sent: str) -> str:
    printable = "".join(character for character in sent if character.isprintable())
    # A mesh may name a resource by its path; a path that leads elsewhere is one of the client's
    # own machine, in its own spelling, and so is that of a mesh.
    path = inside(printable) if field in _RESOURCE_FIELDS else None
    name = path or printable.replace("\\", "/").rpartition("/")[2]
    return name[-NAME_LENGTH:]


def _require_distinct(resources: Mapping[str, tuple[Upload | NamedBlob, ...]]) -> None:
    """Refuse two files of one name for the same mesh: which of them it means would be a guess."""
    for own in ("source_resources", "reference_resources"):
        seen: dict[str, str] = {}
        for field in ("resources", own):
            for file in resources[field]:
                if file.name in seen:
                    raise InputError(_twice(seen[file.name], field), file=file.name)
                seen[file.name] = field


def _twice(first: str, second: str) -> str:
    if first == second:
        return f"form field '{first}' has two files of this name"
    return (
        f"form field '{second}' has a file of this name and so has '{first}', which is for both "
        "meshes: send it in one of them"
    )


async def _options(form: FormData) -> dict[str, Any]:
    value = _single(form, "options")
    if value is None:
        return {}
    if isinstance(value, str):
        return read_options_json(value)
    if (value.size or 0) > OPTIONS_BYTES:
        raise _too_long("options are longer")
    return read_options_json(await value.read())


def _too_long(what: str) -> LimitError:
    return LimitError(
        f"{what} than the {OPTIONS_BYTES} bytes accepted here: send a long list of "
        "pinned vertices as a file in 'source_resources' and name it in cones.pin.vertices_file"
    )


def _sound(options: Options) -> Options:
    require_known(options.gates, options.mode)
    return options


def _require_list(
    options: Options, resources: Mapping[str, tuple[Upload | NamedBlob, ...]]
) -> None:
    name = options.cones.pin.vertices_file
    sent = {file.name for file in resources["source_resources"] + resources["resources"]}
    if name is not None and name not in sent:
        raise InputError(
            f"option 'cones.pin.vertices_file' names '{name}', which was not sent: send it in "
            "form field 'source_resources'"
        )


def _labels(form: FormData) -> tuple[str, ...]:
    values = [value for value in form.getlist("label") if value != ""]
    if len(values) > MAX_LABELS:
        raise LimitError(f"{len(values)} labels are more than the {MAX_LABELS} accepted here")
    labels: list[str] = []
    for value in values:
        if not isinstance(value, str):
            raise InputError("form field 'label' must be plain text, found a file")
        if len(value) > LABEL_LENGTH or not value.isprintable():
            raise InputError(
                f"form field 'label' must be one line of up to {LABEL_LENGTH} characters"
            )
        labels.append(value)
    return tuple(dict.fromkeys(labels))


def _webhook(form: FormData, settings: ServiceSettings) -> str | None:
    value = _single(form, "webhook")
    if value is None or value == "":
        return None
    if not isinstance(value, str):
        raise InputError("form field 'webhook' must be plain text, found a file")
    return require_url(value, "the webhook", private_addresses=settings.webhook_private_addresses)
