"""New numbers for the elements of an OBJ file between which others are put.

Source: "Object Files (.obj)", appendix B1: elements are counted in the order in which they are
stated, each kind by itself, from 1; a negative number counts back from the statement it is in.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.obj.scan import ObjLines

# Statements that name elements, and how many words stand before the first one.
_NAMING = {b"f": 1, b"fo": 1, b"l": 1, b"p": 1, b"curv": 3, b"surf": 5}
_WORD = re.compile(rb"(?:[^\s#\\]|\\(?![\r\n]))+")
_INDEX = re.compile(rb"[+-]?\d{1,18}")


@dataclass(frozen=True)
class Insertion:
    """Statements of one kind that are put between those a file has.

    Attributes:
        rows: (r,) the statements of that kind that there are.
        after: (k,) how many of these stand before each new one, which follows the last of them;
            at least 1.
    """

    rows: NDArray[np.int64]
    after: NDArray[np.int64]

    def numbers(self) -> NDArray[np.int64]:
        """(r + k,) number from 0 of each statement there was, and then of each new one."""
        old = np.arange(len(self.rows))
        order = np.argsort(self.after, kind="stable")
        new = np.empty(len(self.after), dtype=np.int64)
        new[order] = self.after[order] + np.arange(len(self.after))
        return np.concatenate([old + np.searchsorted(self.after[order], old, side="right"), new])


def renumbered(
    lines: ObjLines,
    insertions: Sequence[Insertion],
    skipped: NDArray[np.int64],
    *,
    unknown: bool,
) -> dict[int, bytes]:
    """Statements whose numbers are no longer right, with those that are.

    Numbers that count back still do. A number that no element has goes on having none.

    Args:
        lines: the file.
        insertions: of v, vt and vn statements.
        skipped: statements that are written anew anyway.
        unknown: whether a face names what the file does not have.
    """
    kinds = [_Renumbering(each) for each in insertions]
    # Where all that is new follows all there was, only numbers that count back change.
    few = not unknown and all((each.after == len(each.rows)).all() for each in insertions)
    changed = {}
    for (keyword, first), rows in zip(_NAMING.items(), lines.named(*_NAMING), strict=True):
        asked = rows[~np.isin(rows, skipped)]
        if few and keyword == b"f":
            asked = asked[np.isin(asked, lines.holding(b"-"))]
        for row in asked.tolist():
            changed[row] = _rewritten(lines.raw(row), first, kinds, row)
    return changed


class _Renumbering:
    """What each number of one kind becomes."""

    def __init__(self, insertion: Insertion) -> None:
        self._rows = insertion.rows
        self._now = insertion.numbers()
        self._places = np.sort(insertion.after)

    def of(self, index: int, row: int) -> int:
        """What an index from 1, or back from a statement, is in the new file."""
        count, added = len(self._rows), len(self._places)
        if index > 0:
            return int(self._now[index - 1]) + 1 if index <= count else index + added
        before = int(np.searchsorted(self._rows, row))
        # New ones follow the last of those before them at once, and so stand before the row too.
        new_before = before + int(np.searchsorted(self._places, before, side="right"))
        if index == 0 or before + index < 0:
            return index and index - (new_before - before)
        return int(self._now[before + index]) - new_before


def _rewritten(statement: bytes, first: int, kinds: Sequence[_Renumbering], row: int) -> bytes:
    pieces, done = [], 0
    for place, word in enumerate(_WORD.finditer(statement.partition(b"#")[0])):
        if place < first:
            continue
        parts = word[0].split(b"/")
        for each, (part, kind) in enumerate(zip(parts, kinds, strict=False)):
            if _INDEX.fullmatch(part) and (now := kind.of(int(part), row)) != int(part):
                parts[each] = b"%d" % now
        pieces += [statement[done : word.start()], b"/".join(parts)]
        done = word.end()
    return b"".join([*pieces, statement[done:]])
