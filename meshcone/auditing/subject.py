"""The asset that is audited, and what several checks need of it."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

from meshcone.assets import Asset
from meshcone.assets.content import Content, Draw
from meshcone.files import MeshFile
from meshcone.quality.no_area import without_area
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, row_lengths

UV_SETS_READ = 8  # of a primitive; no viewer reads more

T = TypeVar("T")


class Seen:
    """What was found before, by what it was found of; the files of a job have much in common."""

    def __init__(self) -> None:
        self._found: dict[Hashable, Any] = {}

    def once(self, content: Hashable, find: Callable[[], T]) -> T:
        """What was found of some content, or is now."""
        if content not in self._found:
            self._found[content] = find()
        found: T = self._found[content]
        return found


@dataclass(frozen=True)
class Subject:
    """An asset with its content.

    Attributes:
        file: as sent.
        asset: as read.
        seen: what was found of other assets of the same job.
    """

    file: MeshFile
    asset: Asset
    seen: Seen = field(default_factory=Seen)

    @cached_property
    def content(self) -> Content:
        """All that the file holds."""
        return self.asset.content()

    @cached_property
    def mesh(self) -> Mesh:
        """The welded surface, in model units."""
        asset = self.asset
        return Mesh(asset.vertices, asset.faces, precision=asset.precision)

    @cached_property
    def listed(self) -> Mesh:
        """All triangles that the file lists, over its raw vertices."""
        asset = self.asset
        return Mesh(asset.positions, asset.triangles, precision=asset.precision_as_listed)

    @cached_property
    def solid(self) -> Bools:
        """(k,) which of the listed triangles have an area."""
        return ~without_area(self.listed)

    @cached_property
    def box(self) -> tuple[Floats, Floats]:
        """Least and greatest coordinates of the surface."""
        used = self.mesh.vertices
        return used.min(axis=0), used.max(axis=0)

    @cached_property
    def diagonal(self) -> float:
        """Length of the box's diagonal."""
        low, high = self.box
        return float(row_lengths((high - low)[None])[0])

    def corners(self, draw: Draw, name: str) -> Floats | None:
        """(k, 3, c) values of an attribute at the corners of a draw; None if it has none."""
        attribute = draw.attributes.get(name)
        return None if attribute is None else attribute.at_corners()
