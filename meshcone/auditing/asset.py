"""An asset, looked at from every side: a module for each family of checks."""

from __future__ import annotations

from meshcone.assets import Asset
from meshcone.assets.pictures import read_picture
from meshcone.auditing.budget import budget_of
from meshcone.auditing.geometry import geometry_of
from meshcone.auditing.materials import materials_of
from meshcone.auditing.motion import motion_of
from meshcone.auditing.records import AssetAudit
from meshcone.auditing.shading import shading_of
from meshcone.auditing.size import size_of
from meshcone.auditing.subject import Seen, Subject
from meshcone.auditing.textures import textures_of
from meshcone.auditing.uv import uv_of
from meshcone.auditing.validator import validate
from meshcone.files import MeshFile
from meshcone.quality.records import Validity


def audit_asset(
    file: MeshFile,
    asset: Asset,
    validity: Validity | None = None,
    seen: Seen | None = None,
    *,
    ask_validator: bool = False,
) -> AssetAudit:
    """Look at an asset from every side.

    Args:
        file: the file and what was sent with it.
        asset: the same, as read.
        validity: what was counted on its surface; counted here if it was not.
        seen: what was found of other assets of the same job, and will be added to.
        ask_validator: have Khronos' validator look at a glTF, which starts a process.
    """
    subject = Subject(file, asset, seen or Seen())
    asked = {"validator": validate(file)} if ask_validator else {}
    pictures = tuple(map(read_picture, subject.content.images))
    return AssetAudit(
        budget=budget_of(subject, pictures),
        size=size_of(subject),
        geometry=geometry_of(subject, validity),
        shading=shading_of(subject),
        uv=uv_of(subject, pictures),
        textures=textures_of(subject, pictures),
        materials=materials_of(subject),
        motion=motion_of(subject),
        **asked,
    )
