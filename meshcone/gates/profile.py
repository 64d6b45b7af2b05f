"""Sets of gates for common uses, which come with this package."""

from __future__ import annotations

from importlib.resources import files

from meshcone.errors import InputError
from meshcone.suggestions import did_you_mean

_SUFFIX = ".toml"
_FOLDER = files("meshcone.gates") / "profiles"
PROFILES = tuple(
    sorted(
        each.name.removesuffix(_SUFFIX) for each in _FOLDER.iterdir() if each.name.endswith(_SUFFIX)
    )
)


def profile(name: str) -> bytes:
    """The gate file that a profile is, with the sources of its numbers.

    Raises:
        InputError: there is no such profile.
    """
    if name not in PROFILES:
        hint = did_you_mean(name, PROFILES) or f"; there are {', '.join(PROFILES)}"
        raise InputError(f"unknown profile '{name}'{hint}")
    return (_FOLDER / f"{name}{_SUFFIX}").read_bytes()
