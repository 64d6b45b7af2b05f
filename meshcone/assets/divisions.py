"""The ways a file is divided into parts, by which a caller can say what to refine."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import translate

import numpy as np
from numpy.typing import NDArray

from meshcone.errors import InputError
from meshcone.options import SelectOptions

_SHOWN = 5
# The divisions of a file that answer for a kind of part, the first that it has.
_DIVISIONS = {
    "node": ("nodes", "meshes", "groups"),
    "mesh": ("meshes", "groups"),
    "material": ("materials",),
    "group": ("groups", "meshes"),
}


@dataclass(frozen=True)
class Division:
    """One way a file is divided.

    Attributes:
        names: what each element, such as a node or a material, is called, by its index; an
            empty name is none.
        parts: for each part of the surface, the elements it belongs to: several, where a
            node is below others, or a face in several groups.
        labels: (m,) part of each face.
    """

    names: Mapping[int, str]
    parts: tuple[tuple[int, ...], ...]
    labels: NDArray[np.int64]

    def part_names(self) -> tuple[str, ...]:
        """What each part is called: its elements' names, or numbers where they have none.

        A node's name follows those of the nodes above it. Of several parts with one name, the
        second is called ``name (2)``.
        """
        counts: dict[str, int] = {}
        told = []
        for part in self.parts:
            name = "/".join(self.names[each] or f"#{each}" for each in reversed(part))
            counts[name] = counts.get(name, 0) + 1
            told.append(name if counts[name] == 1 else f"{name} ({counts[name]})")
        return tuple(told)

    def meant_by(self, key: str | int) -> set[int]:
        """Elements that an index, a name, or a pattern with ``*``, ``?`` and ``[…]`` means."""
        if isinstance(key, int):
            return {key} & self.names.keys()
        matches = re.compile(translate(key)).match
        return {i for i, name in self.names.items() if name and (name == key or matches(name))}


def nearest_division(divisions: Mapping[str, Division], by: str) -> Division | None:
    """The division that answers for a kind of part; None where the file has none with names.

    Args:
        divisions: those the file has, by the name of their option.
        by: node, mesh, material or group.
    """
    found = [divisions[name] for name in _DIVISIONS[by] if name in divisions]
    return next((each for each in found if each.names), None)


def select_faces(
    divisions: dict[str, Division], chosen: SelectOptions, faces: int
) -> NDArray[np.bool_]:
    """(m,) faces that every list given in ``chosen`` names.

    Args:
        divisions: those the file has, by the name of their option.
        chosen: the request.
        faces: how many faces there are.

    Raises:
        InputError: the file has no such division or no part of the name, or no face is in all.
    """
    selected = np.ones(faces, dtype=bool)
    for kind, keys in chosen.given().items():
        if kind not in divisions:
            known = ", ".join(f"select.{name}" for name in divisions) or "nothing"
            raise InputError(f"option 'select.{kind}': this format has none; it knows {known}")
        division = divisions[kind]
        meant: set[int] = set()
        for key in keys:
            found = division.meant_by(key)
            if not found:
                raise InputError(f"option 'select.{kind}': {_nothing_called(key, division)}")
            meant |= found
        chosen_parts = np.array([not meant.isdisjoint(part) for part in division.parts])
        selected &= chosen_parts[division.labels]
    if not selected.any():
        raise InputError("option 'select': no face is in all of the parts it names")
    return selected


def _nothing_called(key: str | int, division: Division) -> str:
    names = [f"'{name[:40]}'" for name in dict.fromkeys(division.names.values()) if name]
    known = names or [f"index {index}" for index in division.names]
    shown = ", ".join(known[:_SHOWN]) + (", …" if len(known) > _SHOWN else "")
    wanted = f"index {key}" if isinstance(key, int) else f"'{key}'"
    return f"nothing that is drawn has {wanted}; there are: {shown or 'none'}"
