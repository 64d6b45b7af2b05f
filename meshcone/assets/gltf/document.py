"""Parses the JSON of a glTF and decides whether its claims can be honoured."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import unknown_extensions
from meshcone.assets.gltf.json_faults import json_fault
from meshcone.assets.gltf.json_text import parsed
from meshcone.assets.limits import Limits
from meshcone.errors import InputError, LimitError

# The closing quote is optional and nothing is ever given back: otherwise a string that does not
# end would be scanned again from each of its escaped quotes.
_STRING = re.compile(rb'"[^"\\]*+(?:\\.[^"\\]*+)*+"?', re.DOTALL)

_BLOCK = 1 << 20


@dataclass(frozen=True)
class Document:
    """A glTF's JSON.

    Attributes:
        text: as it stands in the file.
        root: the parsed object.
        unknown: extensions that it requires and of which nothing is known here.
    """

    text: str
    root: Element
    unknown: tuple[str, ...] = ()

    def changed(self, text: str) -> Document:
        """The document after changes to its text that keep it valid."""
        return Document(text, Element(parsed(text.removeprefix("\ufeff"))), self.unknown)

    def uses(self, extension: str) -> bool:
        """Whether the document lists an extension as used or required."""
        return extension in self.root.texts("extensionsUsed") or extension in self.root.texts(
            "extensionsRequired"
        )


def parse_document(data: bytes, limits: Limits) -> Document:
    """Parse JSON and check version, required extensions and array sizes.

    Raises:
        InputError: not JSON, not glTF 2, or a required extension cannot be read.
        LimitError: longer, deeper or with longer arrays than ``limits`` accept.
    """
    limits.check("json_bytes", len(data), "bytes of JSON")
    depth, values = _measure(data)
    limits.check("json_depth", depth, "nested levels of JSON")
    limits.check("json_values", values, "values of JSON")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError("the JSON is not UTF-8", place=f"byte {error.start}") from None
    root = Element(_parse(text))
    _check_version(root)
    for key in ("nodes", "accessors", "meshes"):
        limits.check(key, len(root.children(key)), key, place=f"/{key}")
    return Document(text, root, unknown_extensions(root))


class _FaultError(ValueError):
    """Something is wrong that the parser does not mind."""


def _parse(text: str) -> dict[str, Any]:
    text = text.removeprefix("\ufeff")
    try:
        value = parsed(text, parse_constant=_refuse, object_pairs_hook=_unique_members)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise InputError(f"the JSON is malformed: {error.msg}", place=place) from None
    except ValueError:  # _FaultError, or a whole number too long for Python
        raise json_fault(text) from None
    except RecursionError:
        raise LimitError("the JSON is nested too deeply") from None
    if not isinstance(value, dict):
        raise InputError("the JSON is not an object", place="line 1")
    return value


def _refuse(constant: str) -> NoReturn:
    raise _FaultError(constant)


def _unique_members(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) < len(pairs):
        raise _FaultError
    return members


def _measure(data: bytes) -> tuple[int, int]:
    """Deepest nesting and an upper bound on the values, without parsing.

    A parser would already have recursed, and a value takes up to forty times its text.
    """
    skeleton = np.frombuffer(_STRING.sub(b"", data), dtype=np.uint8)
    level = deepest = values = 0
    for start in range(0, len(skeleton), _BLOCK):
        block = skeleton[start : start + _BLOCK]
        opening = (block == ord("[")) | (block == ord("{"))
        closing = (block == ord("]")) | (block == ord("}"))
        levels = level + np.cumsum(opening.astype(np.int64) - closing)
        deepest = max(deepest, int(levels.max()))
        level = int(levels[-1])
        values += int(np.count_nonzero(opening)) + int(np.count_nonzero(block == ord(",")))
    return deepest, values + 1


def _check_version(root: Element) -> None:
    asset = root.child("asset")
    if asset is None:
        raise InputError("'asset' is missing: the JSON is not a glTF", place="/asset")
    version = _version(asset)
    needed = asset.text("minVersion") or "2.0"
    if not re.fullmatch(r"2\.\d{1,9}", version):
        raise asset.error("version", f"glTF version '{version[:20]}'; expected 2.0")
    if needed != "2.0":
        raise asset.error("minVersion", f"needs glTF '{needed[:20]}'; 2.0 is supported")


def _version(asset: Element) -> str:
    """What a file says of its version; some exporters write a number, and viewers read that."""
    if isinstance(asset.value.get("version"), str):
        return asset.text("version") or ""
    number = asset.number("version")
    return "" if number is None else f"{number:.1f}"
