"""Pairs to gate, and the manifests that list them."""

from __future__ import annotations

import csv
import io
import json
import tomllib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from meshcone.errors import InputError
from meshcone.local_files import files_of, read_bytes
from meshcone.suggestions import did_you_mean, first_cause
from meshcone.text import as_text


@dataclass(frozen=True)
class Pair:
    """An asset and the reference it is held against.

    Attributes:
        name: what globs and reports know it by; its path, unless a manifest says otherwise.
        source, reference: where the files are.
    """

    name: str
    source: Path
    reference: Path

    def has(self, files: Iterable[Path]) -> bool:
        """Whether one of these files is its source, its reference or one that they name."""
        own = {file.resolve() for file in self.files()}
        return any(file.resolve() in own for file in files)

    def files(self) -> list[Path]:
        """Both meshes and the files beside them that they name."""
        return files_of(self.source) + files_of(self.reference)


def single_pair(source: Path, reference: Path) -> Pair:
    """A pair given on the command line."""
    return Pair(as_text(source.as_posix()), source, reference)


def shown(path: Path) -> str:
    """A path as reports name it: below the working directory if it is there, else absolute."""
    whole = path.resolve()
    here = Path.cwd()
    path = whole.relative_to(here) if whole.is_relative_to(here) else whole
    return as_text(path.as_posix())


class _Entry(BaseModel):
    """One pair of a manifest; paths are relative to the manifest."""

    model_config = ConfigDict(extra="forbid", strict=True)

    source: str = Field(min_length=1)
    reference: str = Field(min_length=1)
    name: str | None = Field(None, min_length=1, max_length=200)


def read_manifest(path: Path) -> list[Pair]:
    """Read a list of pairs: JSON or CSV if the name ends so, else TOML.

    JSON is ``[{"source": …, "reference": …, "name": …}]`` or such a list under ``pairs``;
    TOML has tables ``[[pairs]]``; CSV has a column for each.

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
    pairs = [_pair(path, number, entry) for number, entry in enumerate(entries, start=1)]
    _require_distinct(path, pairs)
    return pairs


def _entries(path: Path, text: str) -> Any:
    suffix = path.suffix.lower()
    if suffix == ".csv":
        # What a row has beyond the header is no value of a column; without it, nothing is.
        return list(csv.DictReader(io.StringIO(text), restkey="further columns", strict=True))
    document = json.loads(text) if suffix == ".json" else tomllib.loads(text)
    if not isinstance(document, dict):
        return document
    unknown = [name for name in document if name != "pairs"]
    if unknown:
        hint = did_you_mean(unknown[0], ["pairs"])
        raise InputError(f"unknown key '{unknown[0]}'{hint}", file=str(path))
    return document.get("pairs")


def _pair(path: Path, number: int, entry: Any) -> Pair:
    try:
        if isinstance(entry, dict):  # an empty cell of a table is no name
            entry = {key: value for key, value in entry.items() if (key, value) != ("name", "")}
        checked = _Entry.model_validate(entry)
    except ValidationError as error:
        message = _explain(error)
        raise InputError(message, file=str(path), place=f"pair {number}") from None
    source = Path(checked.source)
    return Pair(
        checked.name or as_text(source.as_posix()),
        path.parent / source,
        path.parent / checked.reference,
    )


def _explain(error: ValidationError) -> str:
    first = first_cause(error)
    if not first["loc"]:
        return "expected a source and a reference"
    key = str(first["loc"][0])
    if first["type"] == "extra_forbidden":
        return f"unknown key '{key}'{did_you_mean(key, _Entry.model_fields)}"
    return f"'{key}': {first['msg'].lower()}"


def _require_distinct(path: Path, pairs: Sequence[Pair]) -> None:
    [(name, times)] = Counter(pair.name for pair in pairs).most_common(1)
    if times > 1:
        raise InputError(
            f"{times} pairs are called '{name}'; give each a 'name' of its own", file=str(path)
        )
