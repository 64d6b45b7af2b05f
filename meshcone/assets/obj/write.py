"""Rewrites the three numbers of v and vn statements, and nothing else of the file."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.number_style import NumberStyle
from meshcone.assets.obj.scan import ObjLines

_BLANK = rb"(?:[ \t\f\v]|\\(?:\r\n|\r|\n))"
_WORD = rb"[^\s#\\]+"
_VECTOR = re.compile(
    rb"((?:\xef\xbb\xbf)?%(b)s*(?:v|vn)%(b)s+)(%(w)s)(%(b)s+)(%(w)s)(%(b)s+)(%(w)s)"
    % {b"b": _BLANK, b"w": _WORD}
)

_SAMPLED_STATEMENTS = 20_000


def number_style(
    lines: ObjLines, rows: NDArray[np.int64], most: int = _SAMPLED_STATEMENTS
) -> NumberStyle:
    """How v or vn statements write their numbers, by an even sample of about so many."""
    step = max(1, len(rows) // most)
    return NumberStyle.of(
        word for row in rows[::step].tolist() for word in lines.leading_words(row, 4)[1:]
    )


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
