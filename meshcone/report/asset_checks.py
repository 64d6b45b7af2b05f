"""Warnings for what an asset names and does not come with, and for normals it stores."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from meshcone.auditing.records import AssetAudit
from meshcone.notices import Code, Notice, Side, Told, WarningRecord

_NAMED = 3
# Artists bend the normals of foliage; more than this share is another matter.
_MOST = 0.5

NOT_AUDITED = Told(
    [],
    frozenset(
        {
            Code.MATERIALS_LIBRARY_MISSING,
            Code.MATERIALS_UNDEFINED,
            Code.NORMALS_AGAINST_WINDING,
            Code.TEXTURES_MISSING,
        }
    ),
)


def asset_warnings(side: Side, file: str, audit: AssetAudit | None) -> list[WarningRecord]:
    """Say which materials, libraries and images of a file are not there, and what is turned.

    Args:
        side: whose file it is.
        file: its name.
        audit: what was found of it; None where nobody looked.
    """
    return [] if audit is None else [each.about(side, file) for each in _notices(audit)]


def _notices(audit: AssetAudit) -> Iterator[Notice]:
    libraries = audit.materials.missing_libraries
    if libraries:
        words = (
            "a material library that it names was"
            if libraries == 1
            else (f"{libraries:,} material libraries that it names were")
        )
        yield Notice(Code.MATERIALS_LIBRARY_MISSING, f"{words} not sent with it")
    undefined = [each.name for each in audit.materials.items if not each.defined]
    if undefined:
        what = _listed("material", undefined)
        yield Notice(Code.MATERIALS_UNDEFINED, f"{what} named and nowhere defined")
    missing = [each.name for each in audit.textures.images if each.fault == "missing"]
    if missing:
        yield Notice(Code.TEXTURES_MISSING, f"{_listed('image', missing)} not sent with it")
    against = audit.shading.opposed_normals_share
    if against > _MOST:
        words = f"{100 * against:.0f} % of its stored normals point to the backs of their faces"
        yield Notice(Code.NORMALS_AGAINST_WINDING, words)


def _listed(what: str, names: Sequence[str]) -> str:
    """``material 'red' is`` or ``4 materials ('a', 'b', 'c', …) are``."""
    shown = [f"'{name[:60]}'" for name in names[:_NAMED]]
    if len(names) == 1:
        return f"{what} {shown[0]} is"
    more = ", …" if len(names) > _NAMED else ""
    return f"{len(names):,} {what}s ({', '.join(shown)}{more}) are"
