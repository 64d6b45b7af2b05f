"""Tells a pointer to a file from the file.

Source: Git LFS specification, "The Pointer": a text file of up to 1,024 bytes that begins
with the address of the specification's version.
"""

from __future__ import annotations

from meshcone.errors import InputError

_BEGINNING = b"version https://git-lfs.github.com/spec/"


def refuse_pointer(data: bytes, place: str | None = None) -> None:
    """Refuse what Git LFS leaves in a checkout where the file itself was not fetched.

    Raises:
        InputError: the bytes are such a pointer.
    """
    if data.startswith(_BEGINNING):
        raise InputError(
            "this is a Git LFS pointer, not the file itself; fetch it first (git lfs pull)",
            place=place,
        )
