"""Lists of vertices too long for the options: a file sent with the source, or beside it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from meshcone.errors import InputError, LimitError
from meshcone.options import Options
from meshcone.surface.arrays import Ints

LIST_BYTES = 8 * 1024 * 1024
"""Size of a list at most: a million vertices of seven digits each."""


def listed_vertices(options: Options, resources: Mapping[str, bytes], count: int) -> Ints:
    """The vertices that the file of ``cones.pin.vertices_file`` names, sorted; none without one.

    Args:
        options: which name the file.
        resources: the source's, where the file is.
        count: vertices that the source file has.

    Raises:
        InputError: the file is not there, is no list of indices, or names a vertex that the
            source does not have.
        LimitError: the file is too long.
    """
    name = options.cones.pin.vertices_file
    if name is None:
        return np.empty(0, dtype=np.int64)
    if name not in resources:
        raise InputError(
            f"option 'cones.pin.vertices_file' names '{name}', which was not sent: send it in "
            "'source_resources', or keep it beside the source"
        )
    data = resources[name]
    if len(data) > LIST_BYTES:
        raise LimitError(
            f"the list has {len(data)} bytes; up to {LIST_BYTES} are accepted", file=name
        )
    found = _numbers(data, name)
    if found and max(found) >= count:
        raise InputError(
            f"names vertex {max(found)}; the source has {count}, counted from 0", file=name
        )
    return np.unique(np.array(found, dtype=np.int64))


def _numbers(data: bytes, name: str) -> list[int]:
    found: Any
    try:
        text = data.decode("utf-8-sig")
        found = json.loads(text) if text.lstrip().startswith("[") else _words(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, list) or not all(type(each) is int and each >= 0 for each in found):
        raise InputError(
            "expected indices of vertices, counted from 0: a JSON array, or text with spaces or "
            "lines between them",
            file=name,
        )
    return found


def _words(text: str) -> list[int]:
    words = text.split()
    if not all(word.isascii() and word.isdigit() for word in words):
        raise ValueError(text[:40])
    return [int(word) for word in words]
