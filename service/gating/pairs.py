"""Pairs to gate, and the manifests that list them."""

from __future__ import annotations

import csv
import io
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from meshcone.errors import InputError
from meshcone.gates.levels import level_of
from meshcone.json_text import parse_json
from meshcone.local_files import files_of, read_bytes
from meshcone.places import real
from meshcone.suggestions import did_you_mean, first_cause, in_words
from meshcone.text import as_text
from service.api.request_schemas import LinkedFile
from service.client.links import is_link, link_to, shown_link

Place = Path | LinkedFile


@dataclass(frozen=True)
class Pair:
    """An asset and the reference it is held against, if there is one.

    Attributes:
        name: what globs and reports know it by; its path, unless a manifest says otherwise.
        source, reference: where the files are, on this machine or for a service to fetch; without
            a reference, the asset is audited.
        level: of detail, 1 for the first below the reference; None where it is none. Levels
            with the same reference are a chain.
    """

    name: str
    source: Place
    reference: Place | None
    level: int | None = None

    def has(self, files: Iterable[Path], listed: str | None = None) -> bool:
        """Whether one of these files is its source, its reference or one that goes with them."""
        own = {real(file) for file in self.files(listed)}
        return any(real(file) in own for file in files)

    def files(self, listed: str | None = None) -> list[Path]:
        """The meshes of this machine, the files beside them that they name, and one more.

        Args:
            listed: the file beside the source that its options name.
        """
        places = ((self.source, listed), (self.reference, None))
        return [
            file
            for place, also in places
            if isinstance(place, Path)
            for file in files_of(place, also)
        ]


def single_pair(source: Path, reference: Path | None) -> Pair:
    """An asset given on the command line."""
    return Pair(as_text(source.as_posix()), source, reference, level_of(source.name))


def shown(path: Place) -> str:
    """A path as reports name it: below the working directory if it is there, else absolute.

    A URL is shown without its query, which may be a secret.
    """
    if isinstance(path, LinkedFile):
        return shown_link(path.url)
    whole = real(path)
    here = Path.cwd()
    path = whole.relative_to(here) if whole.is_relative_to(here) else whole
    return as_text(path.as_posix())


MOST_LEVELS = 99


def _as_name(written: str) -> str:
    if "\0" in written:
        raise ValueError("a file's name has no NUL in it")
    return written


_Path = Annotated[str, Field(min_length=1), AfterValidator(_as_name)]


class _Entry(BaseModel):
    """One pair of a manifest, or a chain; paths are relative to the manifest, URLs are not."""

    model_config = ConfigDict(extra="forbid", strict=True)

    source: _Path | None = None
    reference: _Path
    name: str | None = Field(None, min_length=1, max_length=200)
    lod: Annotated[int, Field(ge=1, le=MOST_LEVELS)] | list[_Path] | None = None

    @model_validator(mode="after")
    def _is_pair_or_chain(self) -> _Entry:
        if isinstance(self.lod, list):
            if self.source is not None:
                raise ValueError("a list 'lod' names the sources: leave 'source' away")
            if not 1 <= len(self.lod) <= MOST_LEVELS:
                raise ValueError(f"'lod' lists 1 to {MOST_LEVELS} files")
        elif self.source is None:
            raise ValueError("'source' is missing")
        return self


def read_manifest(path: Path) -> list[Pair]:
    """Read a list of pairs: JSON or CSV if the name ends so, else TOML.

    JSON is ``[{"source": …, "reference": …, "name": …, "lod": …}]`` or such a list under
    ``pairs``; TOML has tables ``[[pairs]]``; CSV has a column for each. ``lod`` is the level of
    detail that a source is, or the list of all its reference has, in place of ``source``.

    Raises:
        InputError: it cannot be read, lists nothing, or two of its pairs have the same name.
    """
    try:
        entries = _entries(path, read_bytes(path).decode("utf-8-sig"))
    except (ValueError, csv.Error, RecursionError) as error:
        kind = path.suffix.removeprefix(".").upper() or "TOML"
        reason = next(iter(str(error).splitlines()), "it is nested too deeply")
        raise InputError(f"is no valid {kind}: {reason}", file=str(path)) from None
    if not isinstance(entries, list) or not entries:
        raise InputError("lists no pairs; see `pairs` in docs/ci.md", file=str(path))
    pairs = [
        pair
        for number, entry in enumerate(entries, start=1)
        for pair in _pairs(path, _checked(path, number, entry))
    ]
    _require_distinct(path, pairs)
    return pairs


def _entries(path: Path, text: str) -> Any:
    suffix = path.suffix.lower()
    if suffix == ".csv":
        # What a row has beyond the header is no value of a column; without it, nothing is.
        rows = csv.DictReader(io.StringIO(text), restkey="further columns", strict=True)
        columns = rows.fieldnames or []
        twice = next((name for name in columns if columns.count(name) > 1), None)
        if twice is not None:
            reason = f"column '{twice}' is there twice; keep one of the two"
            raise InputError(reason, file=str(path))
        return list(rows)
    document = parse_json(text) if suffix == ".json" else tomllib.loads(text)
    if not isinstance(document, dict):
        return document
    unknown = [name for name in document if name != "pairs"]
    if unknown:
        hint = did_you_mean(unknown[0], ["pairs"])
        raise InputError(f"unknown key '{unknown[0]}'{hint}", file=str(path))
    return document.get("pairs")


def _checked(path: Path, number: int, entry: Any) -> _Entry:
    try:
        if isinstance(entry, dict):  # an empty cell of a table is no value
            entry = {
                key: value
                for key, value in entry.items()
                if key not in ("name", "lod") or value != ""
            }
            if path.suffix.lower() == ".csv" and str(entry.get("lod", "")).isdecimal():
                entry["lod"] = int(entry["lod"])
        return _Entry.model_validate(entry)
    except ValidationError as error:
        message = _explain(error)
        raise InputError(message, file=str(path), place=f"pair {number}") from None


def _pairs(path: Path, entry: _Entry) -> Iterator[Pair]:
    """The pair an entry is, or those of its chain."""
    if isinstance(entry.lod, list):
        for number, source in enumerate(entry.lod, start=1):
            yield _pair(path, entry, source, number, f"_LOD{number}")
    elif entry.source is not None:
        own = shown_link(entry.source) if is_link(entry.source) else entry.source
        level = level_of(own) if entry.lod is None else entry.lod
        yield _pair(path, entry, entry.source, level)


def _pair(path: Path, entry: _Entry, source: str, level: int | None, ending: str = "") -> Pair:
    own = shown_link(source) if is_link(source) else Path(source).as_posix()
    name = as_text(own) if entry.name is None else entry.name + ending
    return Pair(name, _place(path, source), _place(path, entry.reference), level)


def _place(manifest: Path, written: str) -> Place:
    return link_to(written) if is_link(written) else manifest.parent / written


def _explain(error: ValidationError) -> str:
    first = first_cause(error)
    if first["type"] == "value_error":
        return first["msg"].removeprefix("Value error, ")
    if not first["loc"]:
        return "expected a source and a reference"
    key = str(first["loc"][0])
    if first["type"] == "extra_forbidden":
        return f"unknown key '{key}'{did_you_mean(key, _Entry.model_fields)}"
    if key == "lod":
        return f"'lod': expected a level from 1 to {MOST_LEVELS}, or a list of files"
    return f"'{key}': {in_words(first)}"


def _require_distinct(path: Path, pairs: Sequence[Pair]) -> None:
    [(name, times)] = Counter(pair.name for pair in pairs).most_common(1)
    if times > 1:
        raise InputError(
            f"{times} pairs are called '{name}'; give each a 'name' of its own", file=str(path)
        )
