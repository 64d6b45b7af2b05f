"""All families of one asset."""

from __future__ import annotations

from meshcone.auditing.records.budget import Budget
from meshcone.auditing.records.geometry import Geometry
from meshcone.auditing.records.materials import Materials
from meshcone.auditing.records.motion import Motion
from meshcone.auditing.records.section import Section
from meshcone.auditing.records.shading import Shading
from meshcone.auditing.records.size import Size
from meshcone.auditing.records.textures import Textures
from meshcone.auditing.records.uv import Uv
from meshcone.auditing.records.validator import Validator


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
    validator: Validator = Validator(not_tested="asked in audits, and where a gate is about it")
