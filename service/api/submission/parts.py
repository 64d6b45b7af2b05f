"""What a submission must be, whichever way it came."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any, BinaryIO

from meshcone.errors import InputError, LimitError
from meshcone.gates.fitting import require_known, require_units
from meshcone.gates.units import format_named
from meshcone.options import Options, parse_options
from meshcone.relative_names import NAME_LENGTH, inside
from meshcone.text import as_line, is_line
from service.api.request_schemas import LABEL_LENGTH, FileByName, NamedBlob, OutputPlace
from service.settings import ServiceSettings
from worker.jobs.records import Output, OutputName, RemoteFile
from worker.outbound.addresses import require_url
from worker.transfers.places import last_name, require_source, require_target

RESOURCE_FIELDS = ("source_resources", "reference_resources", "resources")
MAX_LABELS = 16
OPTIONS_BYTES = 64 * 1024  # kept in the broker's memory for as long as the job is known
_GLTF = (".gltf", ".glb")
_NO_NAMES = ("", ".", "..")


@dataclass(frozen=True)
class Upload:
    """A sent file, spooled to disk if it is large."""

    name: str
    file: BinaryIO
    size: int


AnyFile = Upload | NamedBlob | RemoteFile


@dataclass(frozen=True)
class SubmittedForm:
    """A form whose fields are sound; nothing is known yet of what is in the files."""

    source: AnyFile
    reference: AnyFile | None
    source_resources: tuple[AnyFile, ...]
    reference_resources: tuple[AnyFile, ...]
    resources: tuple[AnyFile, ...]
    options: Options
    options_as_sent: dict[str, Any]
    labels: tuple[str, ...]
    webhook: str | None
    outputs: Mapping[OutputName, Output]


def submission_of(
    *,
    source: AnyFile,
    reference: AnyFile | None,
    resources: Mapping[str, tuple[AnyFile, ...]],
    options: Mapping[str, Any],
    labels: Iterable[str],
    webhook: str | None,
    outputs: Mapping[OutputName, OutputPlace],
    settings: ServiceSettings,
    parse: Callable[[dict[str, Any]], Options] = parse_options,
) -> SubmittedForm:
    """A submission of these parts, if they can be used together.

    Args:
        source: the mesh.
        reference: the mesh that it should have been, if there is one.
        resources: further files, by the field they came in.
        options: as they were sent.
        labels: as they were sent.
        webhook: as it was sent.
        outputs: where to put what is made.
        settings: how much is accepted, and from where.
        parse: what the options are parsed with.

    Raises:
        InputError: a part cannot be used, or does not fit the others.
        LimitError: there are too many of them.
    """
    count = sum(map(len, resources.values()))
    if count > settings.max_resources:
        raise LimitError(
            f"{count} resources are more than the {settings.max_resources} accepted here"
        )
    _require_distinct(resources)
    sent = dict(options)
    parsed = _sound(parse(sent))
    _require_list(parsed, resources)
    _require_units(parsed, source.name, None if reference is None else reference.name)
    if reference is None:
        _require_alone(parsed, resources["reference_resources"])
    else:
        parsed.gated_within(source.name, reference.name)  # refuses a tolerance of no use
    return SubmittedForm(
        source=source,
        reference=reference,
        **resources,
        options=parsed,
        options_as_sent=sent,
        labels=labels_of(labels),
        webhook=webhook_of(webhook, settings),
        outputs={name: _output(name, place, settings) for name, place in outputs.items()},
    )


def named_file(field: str, file: FileByName, settings: ServiceSettings) -> NamedBlob | RemoteFile:
    """A file that is named and not sent, if it can be had.

    Raises:
        InputError: its name or its place cannot be used.
    """
    if isinstance(file, NamedBlob):
        return file.model_copy(update={"name": file_name(field, file.name)})
    what = f"the URL of '{field}'"
    require_source(file.url, what, settings, file.authorization)
    name = last_name(file.url) if file.name is None else file.name
    if name in _NO_NAMES:
        raise InputError(f"{what} ends in no file name: give one as 'name'")
    name = file_name(field, name)
    if file.resources is not None and field in RESOURCE_FIELDS:
        raise InputError(f"'resources' is for a mesh, and '{field}' holds what a mesh names")
    if file.resources is not None and PurePosixPath(name).suffix.lower() not in _GLTF:
        raise InputError("only a .gltf or .glb can have its resources fetched", file=name)
    return RemoteFile(
        name=name,
        url=file.url,
        sha256=file.sha256,
        authorization=file.authorization,
        resources=file.resources,
    )


def file_name(field: str, sent: str) -> str:
    """The name of a file, or of a resource its path below the mesh's folder.

    A mesh's name that is too long is known by its end, where its format is; the path of a resource
    is not, as its end would be the path of another file.

    Raises:
        InputError: nothing of it is a name, or it is a path that is too long.
    """
    line = as_line(sent)
    # A mesh may name a resource by its path; a path that leads elsewhere is one of the client's
    # own machine, in its own spelling, and so is that of a mesh.
    path = inside(line) if field in RESOURCE_FIELDS else None
    name = path or line.replace("\\", "/").rpartition("/")[2]
    if name in _NO_NAMES:
        raise InputError(f"the file in form field '{field}' has no name")
    if field in RESOURCE_FIELDS and len(name) > NAME_LENGTH:
        raise InputError(
            f"the path of a file in form field '{field}' has {len(name)} characters, and up to "
            f"{NAME_LENGTH} can be used: give it a shorter one, in the mesh too",
            file=name.rpartition("/")[2][-NAME_LENGTH:],
        )
    return name[-NAME_LENGTH:]


def too_long(what: str) -> LimitError:
    """What to raise where options, or another text, are longer than is kept."""
    return LimitError(
        f"{what} than the {OPTIONS_BYTES} bytes accepted here: send a long list of "
        "pinned vertices as a file in 'source_resources' and name it in cones.pin.vertices_file"
    )


def _require_distinct(resources: Mapping[str, tuple[AnyFile, ...]]) -> None:
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


def _sound(options: Options) -> Options:
    require_known(options.gates, options.mode)
    return options


def _require_units(options: Options, source: str, reference: str | None) -> None:
    held = None if reference is None else format_named(reference)
    scaled = options.align == "similarity"
    require_units(options.gates, format_named(source), held, scaled=scaled)


def _require_list(options: Options, resources: Mapping[str, tuple[AnyFile, ...]]) -> None:
    name = options.cones.pin.vertices_file
    sent = {file.name for file in resources["source_resources"] + resources["resources"]}
    if name is not None and name not in sent:
        raise InputError(
            f"option 'cones.pin.vertices_file' names '{name}', which was not sent: send it in "
            "form field 'source_resources'"
        )


def _require_alone(options: Options, resources: tuple[AnyFile, ...]) -> None:
    """Refuse a missing reference, unless it is an audit, which can do without."""
    if options.mode != "audit":
        raise InputError("form field 'reference' is missing: send the mesh file in it")
    if resources:
        raise InputError("form field 'reference_resources' is sent without a 'reference'")


def webhook_of(sent: str | None, settings: ServiceSettings) -> str | None:
    """A webhook's URL, if one was sent; an :class:`InputError` if it cannot be used."""
    if not sent:
        return None
    return require_url(sent, "the webhook", private_addresses=settings.webhook_private_addresses)


def _output(name: str, place: OutputPlace, settings: ServiceSettings) -> Output:
    require_target(place.url, f"the URL of output '{name}'", settings, place.authorization)
    return Output(url=place.url, authorization=place.authorization)


def labels_of(sent: Iterable[str]) -> tuple[str, ...]:
    """Labels that can be used, each once; empty ones are left out.

    Raises:
        InputError, LimitError: one of them, or their number, is too long.
    """
    labels = [label for label in sent if label != ""]
    if len(labels) > MAX_LABELS:
        raise LimitError(f"{len(labels)} labels are more than the {MAX_LABELS} accepted here")
    for label in labels:
        if len(label) > LABEL_LENGTH or not is_line(label):
            raise InputError(
                f"form field 'label' must be one line of up to {LABEL_LENGTH} characters"
            )
    return tuple(dict.fromkeys(labels))
