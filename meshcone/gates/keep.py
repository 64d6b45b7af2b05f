"""Gates for "the same asset, with other triangles": nothing else may have changed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal, get_args

from meshcone.auditing.records.changes import ChangeCounts, ChangeKind
from meshcone.errors import InputError
from meshcone.gates.rules import GateRule, GateTable
from meshcone.suggestions import did_you_mean

Kept = Literal["uvs", "materials", "textures", "animations", "hierarchy", "normals", "all"]

ALL = "all"
_KINDS: tuple[ChangeKind, ...] = get_args(ChangeKind)
_KEPT: Mapping[str, tuple[str, ...]] = {
    "uvs": ("uv_sets",),
    "materials": ("materials", "libraries", "meshes"),
    "textures": ("images", "materials"),
    "animations": ("animations", "skins", "morph_targets"),
    "hierarchy": ("scenes", "nodes", "meshes"),
    "normals": ("attributes",),
    # An exporter may add extensions for how it stores things: see _ADDED_FREELY.
    ALL: tuple(ChangeCounts.model_fields),
}
KEPT: tuple[str, ...] = get_args(Kept)
# What changes do not see: surfaces turned inside out, and normals that point to the back.
_OUTWARDS: GateTable = {
    "warnings.normals.opposed": GateRule(max=0),
    "asset.shading.opposed_normals_share": GateRule(max=0.1),
}
_ADDED_FREELY = frozenset({"extensions", "extras"})


def keep_gates(names: Iterable[str]) -> GateTable:
    """Gates against every change of what is to be kept.

    Args:
        names: of :data:`KEPT`.

    Raises:
        InputError: there is no such name.
    """
    gates: dict[str, GateRule] = {}
    for name in names:
        if name not in _KEPT:
            hint = did_you_mean(name, KEPT) or f"; there are {', '.join(KEPT)}"
            raise InputError(f"--keep: unknown '{name}'{hint}")
        for kind in _KINDS:
            for what in _KEPT[name]:
                if kind != "added" or what not in _ADDED_FREELY:
                    gates[f"changes.{kind}.{what}"] = GateRule(max=0)
        if name in ("normals", ALL):
            gates |= _OUTWARDS
    return gates
