"""Damaged copies of an asset that has everything, and what is told of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from meshcone.assets import Asset, read_asset
from meshcone.auditing.changes import changes_between
from meshcone.auditing.records.changes import Changes
from tests.whole_asset import Document, whole

Damage = Callable[[dict[str, Any]], object]


def asset_of(document: Document) -> Asset:
    return read_asset("a.gltf", document.to_bytes())


def after(damage: Damage) -> Changes:
    """What changed in a copy of the asset that was damaged."""
    copy = whole()
    damage(copy.json)
    return changes_between(asset_of(whole()), asset_of(copy))


def counted(changes: Changes) -> dict[str, int]:
    return {
        f"{kind}.{what}": count
        for kind in ("lost", "added", "renamed", "moved", "altered")
        for what, count in getattr(changes, kind).model_dump().items()
        if count
    }
