"""Rewrites the three numbers of v and vn statements, and nothing else of the file."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.obj.scan import ObjLines

_BLANK = rb"(?:[ \t\f\v]|\\(?:\r\n|\r|\n))"
_WORD = rb"[^\s#\\]+"
_VECTOR = re.compile(
    rb"((?:\xef\xbb\xbf)?%(b)s*(?:v|vn)%(b)s+)(%(w)s)(%(b)s+)(%(w)s)(%(b)s+)(%(w)s)"
    % {b"b": _BLANK, b"w": _WORD}
)

_FEWEST_DIGITS = 6
_MOST_DIGITS = 17  # what it takes to write any float64 so that it reads back the same
_SAMPLED_STATEMENTS = 20_000


def replace_vectors(
    raw: list[bytes],
    rows: NDArray[np.int64],
    old: NDArray[np.float64],
    new: NDArray[np.float64],
    digits: int,
) -> None:
    """Put new values into statements, in place.

    Coordinates that do not change keep their text, zeros and all.

    Args:
        raw: the statements.
        rows: (k,) the statements to change.
        old: (k, 3) what they say.
        new: (k, 3) what they shall say.
        digits: significant digits to write, 6 to 17.
    """
    number = b"%%.%dg" % digits
    x, y, z = (new + 0.0).T.tolist()  # adding zero turns -0.0 into 0.0
    same_x, same_y, same_z = (old == new).T.tolist()
    for item, row in enumerate(rows.tolist()):
        statement = raw[row]
        match = _VECTOR.match(statement)
        if match is None:
            raise AssertionError("a statement that was read as a vector no longer looks like one")
        head, old_x, gap, old_y, second_gap, old_z = match.groups()
        raw[row] = b"".join(
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


def significant_digits(lines: ObjLines, rows: NDArray[np.int64]) -> int:
    """The most digits the file spends on one of these numbers, between 6 and 17.

    An even sample of at most 20,000 statements decides.
    """
    step = max(1, len(rows) // _SAMPLED_STATEMENTS)
    most = _FEWEST_DIGITS
    for row in rows[::step].tolist():
        for word in lines.words(row)[1:4]:
            most = max(most, _digits(word))
    return min(most, _MOST_DIGITS)


def digits_for_extent(positions: NDArray[np.float64]) -> int:
    """Digits that resolve a ten-millionth of the model's size.

    A model far from the origin needs more digits than its author's file may have shown.
    """
    span = float(np.ptp(positions, axis=0).max())
    reach = float(np.abs(positions).max())
    if not 0 < span < np.inf:
        return _FEWEST_DIGITS
    return int(np.clip(np.ceil(np.log10(reach / span)) + 7, _FEWEST_DIGITS, _MOST_DIGITS))


def _digits(word: bytes) -> int:
    mantissa = re.split(rb"[eE]", word, maxsplit=1)[0]
    return len(mantissa.lstrip(b"+-0.").replace(b".", b""))
