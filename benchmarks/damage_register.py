"""Ways to damage an asset, by their names."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from damage_model import Model

BOTH, GLTF = ("gltf", "obj"), ("gltf",)

Damage = Callable[[Model], object]
DAMAGES: dict[str, tuple[Damage, Sequence[str]]] = {}


def damage(name: str, formats: Sequence[str] = BOTH) -> Callable[[Damage], Damage]:
    """Enter a way to damage a model under its name."""

    def enter(function: Damage) -> Damage:
        DAMAGES[name] = (function, formats)
        return function

    return enter
