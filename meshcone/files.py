"""A mesh file as it was sent: bytes and the files it names."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from meshcone.text import as_text


@dataclass(frozen=True)
class MeshFile:
    """One uploaded or local mesh.

    Attributes:
        name: file name as the sender knows it; only its suffix and its use in messages matter.
        data: the file's bytes.
        resources: further files it refers to by name (buffers, material libraries).
    """

    name: str
    data: bytes = field(repr=False)
    resources: Mapping[str, bytes] = field(default_factory=dict, repr=False, hash=False)

    def __post_init__(self) -> None:
        # A file system's name need not be text, but reports and messages are.
        object.__setattr__(self, "name", as_text(self.name))

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the bytes, in hexadecimal."""
        return hashlib.sha256(self.data).hexdigest()

    @cached_property
    def resource_hashes(self) -> dict[str, str]:
        """SHA-256 of each resource by its name, in the names' order."""
        return {
            name: hashlib.sha256(data).hexdigest() for name, data in sorted(self.resources.items())
        }
