"""The audits of a job's meshes, and what changed between them."""

from __future__ import annotations

from dataclasses import dataclass

from meshcone.assets import Asset
from meshcone.auditing.asset import audit_asset
from meshcone.auditing.changes import changes_between
from meshcone.auditing.records import AssetAudit, Changes
from meshcone.auditing.subject import Seen
from meshcone.files import MeshFile
from meshcone.notices import Side, Told, WarningRecord
from meshcone.options import Options
from meshcone.quality.records import Validity
from meshcone.report.asset_checks import asset_warnings
from meshcone.report.report import Audits
from meshcone.surface.alignment import Alignment


@dataclass(frozen=True)
class Audited:
    """A mesh to audit.

    Attributes:
        file: as sent, or as written.
        asset: the same, as read.
        validity: what was counted on its surface.
        alignment: what brings it to the reference, if it was brought there.
    """

    file: MeshFile
    asset: Asset
    validity: Validity
    alignment: Alignment | None = None


@dataclass(frozen=True)
class Findings:
    """What a report says of whole assets, besides their surfaces.

    Attributes:
        asset: each by itself.
        changes: of the source against the reference, if there is one.
        told: of what source and reference name and do not come with.
    """

    asset: Audits
    changes: Changes | None
    told: Told


def audited(
    options: Options,
    source: Audited,
    reference: Audited | None,
    refined: Audited | None = None,
) -> Findings:
    """Look at each of the meshes from every side, and at what else changed.

    Args:
        options: of the job; Khronos' validator is asked where the job is an audit or has a gate
            about what it says.
        source: the mesh that was sent.
        reference: what it should have been, if there is such a mesh; points are none.
        refined: the source with its vertices elsewhere, if it was refined.
    """
    if reference is not None and reference.asset.is_points:
        reference = None  # points have nothing besides where they are
    seen = Seen()
    ask = options.mode == "audit" or any(
        key.startswith("asset.") and ".validator." in key for key in options.gates
    )

    def audit(mesh: Audited) -> AssetAudit:
        return audit_asset(mesh.asset.file, mesh.asset, mesh.validity, seen, ask_validator=ask)

    asset = Audits(
        source=audit(source),
        reference=None if reference is None else audit(reference),
        refined=None if refined is None else audit(refined),
    )
    told = _told("source", source, asset.source)
    if reference is None:
        return Findings(asset, None, Told(told))
    assert asset.reference is not None  # noqa: S101 - it was audited above
    told += _told("reference", reference, asset.reference)
    moved = None if source.alignment is None else source.alignment.matrix
    changes = changes_between(reference.asset, source.asset, moved)
    return Findings(asset, changes, Told(told))


def _told(side: Side, mesh: Audited, found: AssetAudit) -> list[WarningRecord]:
    return asset_warnings(side, mesh.file.name, found, mesh.asset.content().faults)
