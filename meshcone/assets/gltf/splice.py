"""Changes values in JSON text and leaves every other character as it is.

Parsing and printing a document again would rewrite its numbers and its layout; a file
under version control should show the change that was made and no other.
"""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

Path = tuple[str | int, ...]

_BYTE_ORDER_MARK = "\ufeff"
_LEXEME = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"|[{}\[\],:]|[^\s{}\[\],:"]+', re.DOTALL)


@dataclass
class JsonChanges:
    """What to do to a JSON text; no path may lie within a replaced or removed one.

    Attributes:
        replaced: JSON text by the path of an existing value, such as ``("accessors", 3, "min")``.
        removed: paths of members of objects.
        added: what to put behind the last entry of an array or object, by its path: JSON text,
            for an object with its key.
    """

    replaced: dict[Path, str] = field(default_factory=dict)
    removed: set[Path] = field(default_factory=set)
    added: dict[Path, list[str]] = field(default_factory=lambda: defaultdict(list))

    def __bool__(self) -> bool:
        return bool(self.replaced or self.removed or self.added)


def replace_values(text: str, replacements: Mapping[Path, str]) -> str:
    """Put other JSON text in the place of existing values. Raises as ``change_json`` does."""
    return change_json(text, JsonChanges(replaced=dict(replacements)))


def change_json(text: str, changes: JsonChanges) -> str:
    """Make changes to valid JSON.

    Raises:
        KeyError: a path does not exist.
    """
    if text.startswith(_BYTE_ORDER_MARK):
        return _BYTE_ORDER_MARK + change_json(text.removeprefix(_BYTE_ORDER_MARK), changes)
    missing = {*changes.replaced, *changes.removed, *changes.added}
    edits: list[tuple[int, int, str]] = []
    for value in _values(text):
        if value.path not in missing:
            continue
        missing.discard(value.path)
        if value.path in changes.replaced:
            edits.append((value.start, value.end, changes.replaced[value.path]))
        elif value.path in changes.added:
            edits.append(_addition(value, changes))
    edits += _removals(text, changes.removed, missing) if changes.removed else []
    if missing:
        raise KeyError(missing.pop())
    pieces = []
    copied = 0
    for start, end, new in sorted(edits):
        pieces += [text[copied:start], new]
        copied = end
    return "".join([*pieces, text[copied:]])


@dataclass(frozen=True)
class _Value:
    """A value and its place in the text.

    Attributes:
        key_start: where its key begins; for an element of an array, where it begins itself.
        entries: of an array or object, how many entries it has.
        entries_end: of an array or object, where the last of them ends, or its bracket.
    """

    path: Path
    key_start: int
    start: int
    end: int
    entries: int = 0
    entries_end: int = 0


def _addition(value: _Value, changes: JsonChanges) -> tuple[int, int, str]:
    gone = sum(path[:-1] == value.path for path in changes.removed)
    new = ", ".join(changes.added[value.path])
    text = f", {new}" if value.entries > gone else new
    return value.entries_end, value.entries_end, text


def _removals(text: str, removed: set[Path], missing: set[Path]) -> list[tuple[int, int, str]]:
    """Cuts that take members and the commas they leave behind out of their objects."""
    parents = {path[:-1] for path in removed}
    members: dict[Path, list[_Value]] = defaultdict(list)
    for value in _values(text):
        if value.path and value.path[:-1] in parents:
            members[value.path[:-1]].append(value)
    cuts = []
    for family in members.values():
        kept_before = False
        for number, member in enumerate(family):
            if member.path not in removed:
                kept_before = True
                continue
            missing.discard(member.path)
            if kept_before:
                cuts.append((family[number - 1].end, member.end, ""))
            elif number + 1 < len(family):
                cuts.append((member.key_start, family[number + 1].key_start, ""))
            else:
                cuts.append((member.key_start, member.end, ""))
    return cuts


@dataclass
class _Open:
    """An array or object that has not ended yet."""

    key_start: int
    start: int
    is_object: bool
    entries: int
    entries_end: int
    entry_start: int = 0


def _values(text: str) -> Iterator[_Value]:
    """Every value, in the order in which they end."""
    path: list[str | int] = []
    open_values: list[_Open] = []
    expect_key = False
    for match in _LEXEME.finditer(text):
        lexeme, start, end = match.group(), match.start(), match.end()
        holder = open_values[-1] if open_values else None
        if lexeme in "{[":
            key_start = holder.entry_start if holder and holder.is_object else start
            open_values.append(_Open(key_start, start, lexeme == "{", 0, end))
            path.append("" if lexeme == "{" else 0)
            expect_key = lexeme == "{"
        elif lexeme in "}]":
            path.pop()
            ended = open_values.pop()
            _count(open_values, end)
            yield _Value(
                tuple(path), ended.key_start, ended.start, end, ended.entries, ended.entries_end
            )
            expect_key = False
        elif lexeme == ",":
            assert holder is not None  # noqa: S101 - the text is valid JSON
            expect_key = holder.is_object
            if not expect_key:
                path[-1] += 1  # type: ignore[operator]
        elif lexeme == ":":
            expect_key = False
        elif expect_key:
            assert holder is not None  # noqa: S101 - the text is valid JSON
            path[-1] = _unquote(lexeme)
            holder.entry_start = start
        else:
            _count(open_values, end)
            key_start = holder.entry_start if holder and holder.is_object else start
            yield _Value(tuple(path), key_start, start, end)


def _count(open_values: list[_Open], end: int) -> None:
    if open_values:
        open_values[-1].entries += 1
        open_values[-1].entries_end = end


def _unquote(lexeme: str) -> str:
    key: str = json.loads(lexeme)
    return key
