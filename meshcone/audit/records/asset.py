"""All families of one asset."""

from __future__ import annotations

from meshcone.audit.records.budget import Budget
from meshcone.audit.records.geometry import Geometry
from meshcone.audit.records.materials import Materials
from meshcone.audit.records.motion import Motion
from meshcone.audit.records.section import Section
from meshcone.audit.records.shading import Shading
from meshcone.audit.records.size import Size
from meshcone.audit.records.textures import Textures
from meshcone.audit.records.uv import Uv


class AssetAudit(Section):
    """What an asset is by itself."""

    budget: Budget
    size: Size
    geometry: Geometry
    shading: Shading
    uv: Uv
    textures: Textures
    materials: Materials
    motion: Motion
