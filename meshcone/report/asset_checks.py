"""Warnings for what an asset names and does not come with, and for normals it stores."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from meshcone.assets.content import Fault
from meshcone.auditing.records import AssetAudit
from meshcone.notices import Code, Notice, Side, Told, WarningRecord

_NAMED = 3
# Artists bend the normals of foliage; more than this share is another matter.
_MOST = 0.5

NOT_AUDITED = Told(
    [],
    frozenset(
        {
            Code.CONTENT_MALFORMED,
            Code.MATERIALS_LIBRARY_MISSING,
            Code.MATERIALS_UNDEFINED,
            Code.NORMALS_AGAINST_WINDING,
            Code.TEXTURES_MISSING,
        }
    ),
)


def asset_warnings(
    side: Side, file: str, audit: AssetAudit, faults: Sequence[Fault]
) -> list[WarningRecord]:
    """Say which materials, libraries and images of a file are not there, and what is wrong in it.

    Args:
        side: whose file it is.
        file: its name.
        audit: what was found of it.
        faults: what is malformed in it.
    """
    notices = [*_notices(audit), *_malformed(faults)]
    return [each.about(side, file) for each in notices]


def _malformed(faults: Sequence[Fault]) -> Iterator[Notice]:
    if not faults:
        return
    told = [f"{each.place or 'the file'}: {each.words}" for each in faults[:_NAMED]]
    what = "a part of it is" if len(faults) == 1 else f"{len(faults):,} parts of it are"
    more = "; …" if len(faults) > _NAMED else ""
    words = f"{what} malformed and read as if absent ({'; '.join(told)}{more})"
    yield Notice(Code.CONTENT_MALFORMED, words, where=faults[0].place)


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
