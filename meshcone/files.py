"""A mesh file as it was sent: bytes and the files it names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class MeshFile:
    """One uploaded or local mesh.

    Attributes:
        name: file name as the sender knows it; only its suffix and its use in messages matter.
        data: the file's bytes.
        resources: further files it refers to by name (buffers, material libraries).
    """

    name: str
    data: bytes
    resources: Mapping[str, bytes] = field(default_factory=dict)
