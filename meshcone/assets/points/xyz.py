"""Reads XYZ files: a line of numbers for each point."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.foreign.polygons import check_positions
from meshcone.assets.foreign.text import decimal
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_WITH_NORMALS = 6
_COMMENTS = (b"#", b"//")
# A comma between characters, and blanks or a semicolon between words without one.
_WITHIN = re.compile(rb"[^\s,;],[^\s,;]")
_BESIDE_COMMAS = re.compile(rb"[^\s,;](?:\s+|\s*;\s*)[^\s,;]")
_UNIT = 1e-2  # how far from 1 the lengths of normals may be; colours are far from it


def read_xyz(data: bytes, limits: Limits) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Read points, and their normals where the three numbers after each have length 1.

    Other numbers on a line, such as colours and intensities, are passed over.

    Returns:
        (n, 3) points, and (n, 3) normals or None.

    Raises:
        InputError: with the line at fault.
        LimitError: there are more lines or points than ``limits`` accept.
    """
    limits.check("lines", data.count(b"\n") + data.count(b"\r") + 1, "lines")
    numbered = [
        (number, line)
        for number, line in enumerate(data.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith(_COMMENTS)
    ]
    limits.check("vertices", len(numbered), "points")
    if not numbered:
        raise InputError("the file holds no points")
    _require_points(numbered)
    columns = len(_words(numbered[0][1]))
    if columns == 1 and len(numbered) > 1:  # how many points follow
        del numbered[0]
        columns = len(_words(numbered[0][1]))
    values = _values(numbered, columns)
    check_positions(values[:, :3], lambda row: f"line {numbered[row][0]}")
    if columns < _WITH_NORMALS:
        return values[:, :3], None
    normals = values[:, 3:6]
    there = np.isfinite(values[:, :3]).all(axis=1)
    lengths = np.linalg.norm(normals[there], axis=1)
    return values[:, :3], normals if (np.abs(lengths - 1) < _UNIT).all() else None


def _values(numbered: list[tuple[int, bytes]], columns: int) -> NDArray[np.float64]:
    """(n, columns) numbers of all lines."""
    words = [_words(line) for _, line in numbered]
    for (number, _), found in zip(numbered, words, strict=True):
        if len(found) != columns or columns < 3:
            expected = "3 or more" if columns < 3 else f"{columns}, as on the first"
            raise InputError(
                f"expected {expected} numbers, found {len(found)}", place=f"line {number}"
            )
    try:
        values = np.fromiter((float(word) for found in words for word in found), np.float64)
    except ValueError:
        _require_numbers(numbered)
        raise
    if any(b"_" in line for _, line in numbered):  # which Python reads as a separator of digits
        _require_numbers(numbered)
    return values.reshape(-1, columns)


def _require_points(numbered: list[tuple[int, bytes]]) -> None:
    for number, line in numbered:
        if b"," in line and _WITHIN.search(line) and _BESIDE_COMMAS.search(line):
            raise InputError(
                "commas stand within words and other separators between them: decimal commas? "
                "Write points, or separate by commas alone",
                place=f"line {number}",
            )


def _words(line: bytes) -> list[bytes]:
    return line.replace(b",", b" ").replace(b";", b" ").split()


def _require_numbers(numbered: list[tuple[int, bytes]]) -> None:
    for number, line in numbered:
        for word in _words(line):
            decimal(word, number)
