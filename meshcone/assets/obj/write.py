"""Rewrites the three numbers of v and vn statements, and nothing else of the file."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.obj.scan import ObjLines

_BLANK = rb"(?:[ \t\f\v]|\\(?:\r\n|\r|\n))"
_WORD = rb"[^\s#\\]+"
_VECTOR = re.compile(
    rb"((?:\xef\xbb\xbf)?%(b)s*(?:v|vn)%(b)s+)(%(w)s)(%(b)s+)(%(w)s)(%(b)s+)(%(w)s)"
    % {b"b": _BLANK, b"w": _WORD}
)

_SAMPLED_STATEMENTS = 20_000
_FEWEST_DIGITS = 6
_MOST_DIGITS = 17  # what it takes to write any float64 so that it reads back the same
_FEWEST_DECIMALS_OF_NORMALS = 4
_MOST_DECIMALS = 20
_DECIMAL = re.compile(rb"[+-]?\d*\.(\d+)")


@dataclass(frozen=True)
class NumberStyle:
    """How a file writes its numbers.

    Attributes:
        fixed: always with the same number of decimals, zeros and all.
        digits: that number, or else the most significant digits any of them shows.
    """

    fixed: bool
    digits: int

    @property
    def format(self) -> bytes:
        """For the % operator."""
        return b"%%.%d%s" % (self.digits, b"f" if self.fixed else b"g")

    def resolving(self, positions: NDArray[np.float64]) -> NumberStyle:
        """The same style with as many digits as positions (n, 3) of this size need.

        A model far from the origin, or very small, needs more than its author's file may
        have shown: a file that does not resolve a millionth of its size gets to resolve a
        ten-millionth.
        """
        span = float(np.ptp(positions, axis=0).max())
        reach = float(np.abs(positions).max())
        if not 0 < span < np.inf:
            return self
        if not self.fixed:
            needed = int(np.clip(np.ceil(np.log10(reach / span)) + 7, 0, _MOST_DIGITS))
            return replace(self, digits=max(self.digits, needed))
        if 10.0**-self.digits <= 1e-6 * span:
            return self
        needed = int(np.ceil(7 - np.log10(span)))
        style = NumberStyle(True, needed)
        return style if needed <= _MOST_DECIMALS else NumberStyle(False, _MOST_DIGITS)

    def for_normals(self) -> NumberStyle:
        """The same style with as many digits as a direction needs."""
        if self.fixed:
            return replace(self, digits=max(self.digits, _FEWEST_DECIMALS_OF_NORMALS))
        return self


def number_style(lines: ObjLines, rows: NDArray[np.int64]) -> NumberStyle:
    """How v or vn statements write their numbers, by an even sample of at most 20,000."""
    step = max(1, len(rows) // _SAMPLED_STATEMENTS)
    most = _FEWEST_DIGITS
    decimals: set[int] = set()
    for row in rows[::step].tolist():
        for word in lines.leading_words(row, 4)[1:]:
            most = max(most, _digits(word))
            match = _DECIMAL.fullmatch(word)
            decimals.add(len(match[1]) if match else 0)
    if len(decimals) == 1 and 0 < max(decimals) <= _MOST_DECIMALS:
        return NumberStyle(True, decimals.pop())
    return NumberStyle(False, min(most, _MOST_DIGITS))


def replaced_vectors(
    lines: ObjLines,
    rows: NDArray[np.int64],
    old: NDArray[np.float64],
    new: NDArray[np.float64],
    style: NumberStyle,
) -> dict[int, bytes]:
    """Statements with new values, by their rows.

    Coordinates that do not change keep their text, zeros and all.

    Args:
        lines: the file.
        rows: (k,) the statements to change.
        old: (k, 3) what they say.
        new: (k, 3) what they shall say.
        style: how to write them.
    """
    number = style.format
    x, y, z = (new + 0.0).T.tolist()  # adding zero turns -0.0 into 0.0
    same_x, same_y, same_z = (old == new).T.tolist()
    statements = {}
    for item, row in enumerate(rows.tolist()):
        statement = lines.raw(row)
        match = _VECTOR.match(statement)
        if match is None:
            raise AssertionError("a statement that was read as a vector no longer looks like one")
        head, old_x, gap, old_y, second_gap, old_z = match.groups()
        statements[row] = b"".join(
            (
                head,
                old_x if same_x[item] else number % x[item],
                gap,
                old_y if same_y[item] else number % y[item],
                second_gap,
                old_z if same_z[item] else number % z[item],
                statement[match.end() :],
            )
        )
    return statements


def _digits(word: bytes) -> int:
    mantissa = re.split(rb"[eE]", word, maxsplit=1)[0]
    return len(mantissa.lstrip(b"+-0.").replace(b".", b""))
