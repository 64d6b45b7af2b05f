"""What an asset is by itself: its budget, size, surface, coordinates, images and materials.

Each family of checks is a module with one record; a field added to it is a value of the
report, and a gate, from that day on.
"""

from __future__ import annotations

from typing import Self

from meshcone.assets import Asset
from meshcone.assets.pictures import read_picture
from meshcone.audit.budget import Budget
from meshcone.audit.geometry import Geometry
from meshcone.audit.materials import Materials
from meshcone.audit.motion import Motion
from meshcone.audit.records import Section
from meshcone.audit.shading import Shading
from meshcone.audit.size import Size
from meshcone.audit.subject import Subject
from meshcone.audit.textures import Textures
from meshcone.audit.uv import Uv

__all__ = ["AssetAudit"]


class AssetAudit(Section):
    """All families of one asset."""

    budget: Budget
    size: Size
    geometry: Geometry
    shading: Shading
    uv: Uv
    textures: Textures
    materials: Materials
    motion: Motion

    @classmethod
    def of(cls, asset: Asset, data_bytes: int, resource_bytes: int = 0) -> Self:
        """Look at an asset from every side.

        Args:
            asset: as read.
            data_bytes: size of its file.
            resource_bytes: size of the files that were sent with it.
        """
        subject = Subject(asset, data_bytes, resource_bytes)
        pictures = tuple(map(read_picture, subject.content.images))
        return cls(
            budget=Budget.of(subject, pictures),
            size=Size.of(subject),
            geometry=Geometry.of(subject),
            shading=Shading.of(subject),
            uv=Uv.of(subject, pictures),
            textures=Textures.of(subject, pictures),
            materials=Materials.of(subject),
            motion=Motion.of(subject),
        )
