"""Options as keyword arguments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict, get_args

from meshcone.errors import InputError
from meshcone.gates.keep import Kept
from meshcone.options import Mode, Options, parse_options


class OptionKeywords(TypedDict, total=False):
    """The options of ``docs/options.md``; those with a dot there are entries of a mapping."""

    keep: Kept | Sequence[Kept]
    preset: Literal["default", "paper"]
    formulation: Literal["surface", "centroid"]
    effort: Literal["fast", "best"]
    align: Literal["none", "rigid", "similarity"]
    normals: Literal["recompute", "keep"]
    instances: Literal["auto", "split", "refuse"]
    pose: Literal["rest", "bind"]
    member: str
    scene: int | str
    lod: int
    of_reference: Mapping[str, Any]
    draco: Literal["plain", "encode"]
    meshopt: Literal["plain", "encode"]
    select: Mapping[str, Any]
    seed: int
    baselines: bool
    within: str | float
    audit: bool
    centroid: Mapping[str, Any]
    surface: Mapping[str, Any]
    cones: Mapping[str, Any]
    solver: Mapping[str, Any]
    quality: Mapping[str, Any]
    deviation: Mapping[str, Any]
    detail: Mapping[str, Any]


def options_from(
    keywords: Mapping[str, Any], mode: Mode, gates: Mapping[str, Any] | None = None
) -> Options:
    """Validate keyword arguments.

    Args:
        keywords: the options' own structure, such as ``surface={"edge_cap": 3}``, or dotted
            names, such as ``**{"surface.edge_cap": 3}``.
        mode: of the function that was called.
        gates: those of an argument of their own.

    Raises:
        InputError: an option is unknown, out of range or given twice.
    """
    document: dict[str, Any] = {}
    given = keywords if gates is None else {**keywords, "gates": gates}
    for name, value in given.items():
        _put(document, name.split("."), plain(value), name)
    if document.setdefault("mode", mode) != mode:
        asked = document["mode"]
        other = asked if asked in get_args(Mode) else "measure or refine"
        raise InputError(f"option 'mode': this is '{mode}'; use meshcone.{other} instead")
    return parse_options(document)


def _put(section: dict[str, Any], path: list[str], value: Any, name: str) -> None:
    """Merge a value into a document that may have part of the same section."""
    head, *rest = path
    if rest:
        inner = section.setdefault(head, {})
        if not isinstance(inner, dict):
            raise InputError(f"'{head}' in '{name}' already has a value of its own")
        _put(inner, rest, value, name)
    elif isinstance(value, dict) and isinstance(section.get(head), dict) and head != "gates":
        for key, each in value.items():
            _put(section[head], [key], each, f"{name}.{key}")
    elif head in section:
        raise InputError(f"option '{name}' is given twice")
    else:
        section[head] = value


def plain(value: Any) -> Any:
    """Take numbers and arrays of numpy as Python's own, and mappings as new dictionaries."""
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    return value.tolist() if hasattr(value, "tolist") else value
