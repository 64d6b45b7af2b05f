"""What the things of a file are called, so that no two of them share a name."""

from __future__ import annotations

from collections.abc import Sequence

from meshcone.assets.content import Content


def unique(names: Sequence[str]) -> list[str]:
    """Names, each its thing's alone: the second of a name has a number after it."""
    seen: dict[str, int] = {}
    keys = []
    for name in names:
        count = seen[name] = seen.get(name, 0) + 1
        keys.append(name if name and count == 1 else f"{name}#{count}")
    return keys


def unique_labels(content: Content) -> list[str]:
    """What each node is called; nodes of one name are numbered in the order of their paths.

    Exporters write nodes in any order, but keep what is above each.
    """
    labels = [content.label(number) for number in range(len(content.nodes))]
    alike: dict[str, list[int]] = {}
    for number, label in enumerate(labels):
        alike.setdefault(label, []).append(number)
    for label, numbers in alike.items():
        if len(numbers) > 1:
            ordered = sorted(numbers, key=lambda number: (content.path(number), number))
            for number, called in zip(ordered, unique([label] * len(ordered)), strict=True):
                labels[number] = called
    return labels
