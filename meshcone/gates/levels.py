"""Levels of detail: which one a file is, and gates with a bound for each."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator

from meshcone.errors import InputError
from meshcone.gates.rules import NUMERIC_BOUNDS, GateRule

_SUFFIX = re.compile(r"(?:(?P<stem>.*)[_. -])?lod_?(?P<level>\d{1,2})", re.IGNORECASE | re.DOTALL)


def split_level(stem: str) -> tuple[str, int | None]:
    """Split the name of a file, without its extension, into what levels share and the level.

    ``rock_LOD2`` is level 2 of ``rock``; ``rock`` has no level. ``_``, ``-``, ``.`` or a space
    stands between the two, and upper and lower case are alike.
    """
    found = _SUFFIX.fullmatch(stem)
    return (found["stem"] or "", int(found["level"])) if found else (stem, None)


def level_of(name: str) -> int | None:
    """The level that a file's name, with forward slashes, says it is."""
    return split_level(PurePosixPath(name).stem)[1]


class LevelRules(BaseModel):
    """The bounds on one value: the same for every level of detail, or some for each.

    A document writes either as one table, in which a numeric bound is a number or a list of
    them, the first for level 1: ``{ max = 100 }``, ``{ max = [100, 50] }``.

    Attributes:
        rules: one for all, or one for each level.
        by_level: whether there is one for each.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    rules: tuple[GateRule, ...]
    by_level: bool

    @model_validator(mode="before")
    @classmethod
    def _from_table(cls, table: object) -> object:
        if not isinstance(table, Mapping):
            return table
        lists = [value for key, value in table.items() if key in NUMERIC_BOUNDS and _is_list(value)]
        if not lists:
            return {"rules": (table,), "by_level": False}
        levels = len(lists[0])
        if levels == 0 or any(len(each) != levels for each in lists):
            raise ValueError("lists of bounds need one number for each level of detail, all alike")
        rules = tuple(dict(_at_level(table, level)) for level in range(levels))
        return {"rules": rules, "by_level": True}

    def at(self, level: int | None, key: str, asset: str) -> GateRule:
        """The bounds at a level.

        Args:
            level: 1 for the first below the reference; None for an asset that is no level.
            key: of the gate, for messages.
            asset: its name, for messages.

        Raises:
            InputError: there are bounds for levels, but none for this one.
        """
        if not self.by_level:
            return self.rules[0]
        count = len(self.rules)
        if level is None:
            raise InputError(
                f"gate '{key}' has a bound for each level of detail, but '{asset}' has no "
                "level: end its name in _LOD1, for example, or give its pair a 'lod'"
            )
        if not 1 <= level <= count:
            raise InputError(
                f"gate '{key}' has bounds for the levels of detail 1 to {count}, but '{asset}' "
                f"is level {level}"
            )
        return self.rules[level - 1]


def _is_list(value: object) -> bool:
    return isinstance(value, list | tuple)


def _at_level(table: Mapping[str, Any], level: int) -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        yield key, value[level] if key in NUMERIC_BOUNDS and _is_list(value) else value
