"""What an object of a glTF says, flat and in words, to be compared with another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

_MOST, _LEVELS, _LETTERS = 100, 3, 40
_ROUNDING = 5  # decimals that exporters keep of a factor


def parameters(value: Mapping[str, Any]) -> dict[str, str]:
    """Members that are numbers, words, truth values or lists of them, by their names.

    Args:
        value: an object. Textures in it are left out, as are names, extras and extensions.

    Returns:
        At most a hundred; a member of a member is called ``spot innerConeAngle``.
    """
    found: dict[str, str] = {}
    for name, told in _flat(value, _LEVELS):
        if len(found) == _MOST:
            break
        found[name] = told
    return found


def _flat(value: Mapping[str, Any], levels: int) -> Iterator[tuple[str, str]]:
    for name, each in sorted(value.items()):
        if name.endswith("Texture") or name in ("name", "extras", "extensions"):
            continue
        if isinstance(each, Mapping):
            inner = _flat(each, levels - 1) if levels else ()
            yield from ((f"{name[:_LETTERS]} {below}", told) for below, told in inner)
        elif isinstance(each, list):
            yield name[:_LETTERS], " ".join(map(_told, each[:16]))
        else:
            yield name[:_LETTERS], _told(each)


def _told(value: Any) -> str:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{round(value, _ROUNDING) + 0.0:g}"
    return str(value)[:_LETTERS]
