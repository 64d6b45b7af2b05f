"""What else changed between a reference and a source: all but the surface.

Things are matched by their names. What has no counterpart of its name is matched by its
content, which makes it renamed; what is left is lost or added.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Set
from typing import Any, Protocol, TypeVar, get_args

from meshcone.assets import Asset
from meshcone.assets.content import Content
from meshcone.auditing.contents import (
    Fact,
    Placed,
    animations,
    attributes,
    fields,
    fittings,
    followers,
    images,
    materials,
    meshes,
    named,
    nodes,
    parts,
    skins,
    targets,
    tracks,
    uv_layouts,
)
from meshcone.auditing.fields import Fields
from meshcone.auditing.hanging import reached, rehung
from meshcone.auditing.parts import Parts
from meshcone.auditing.records.changes import (
    ROWS_KEPT,
    Change,
    ChangeCounts,
    ChangeKind,
    Changes,
)
from meshcone.auditing.variants import variant_names
from meshcone.surface.arrays import Floats

_SHOWN = 80  # characters of a name
_SINGULARS = {"meshes": "mesh", "libraries": "library", "uv_sets": "UV set", "extras": "extra data"}

T = TypeVar("T")


def changes_between(reference: Asset, source: Asset, moved: Floats | None = None) -> Changes:
    """Compare what two files hold.

    Args:
        reference: the one.
        source: the other.
        moved: (4, 4) what brings the source to the reference, if it was brought there.
    """
    kinds: tuple[ChangeKind, ...] = get_args(ChangeKind)
    counts: dict[ChangeKind, Counter[str]] = {kind: Counter() for kind in kinds}
    rows: list[Change] = []
    for change in _differences(reference, source, moved):
        counts[change.kind][change.what] += 1
        if len(rows) < ROWS_KEPT:
            rows.append(change)
    told: dict[ChangeKind, dict[str, int | None]] = {kind: {**counts[kind]} for kind in kinds}
    for open_kind, what in _open(reference.content(), source.content()):
        if not counts[open_kind][what]:
            told[open_kind][what] = None
    found = {kind: ChangeCounts.model_validate(told[kind]) for kind in kinds}
    return Changes.model_validate({**found, "rows": rows})


def _differences(reference: Asset, source: Asset, moved: Floats | None) -> Iterator[Change]:
    old, new = reference.content(), source.content()

    def both(read: Callable[[Content], Mapping[str, T]]) -> tuple[Mapping[str, T], Mapping[str, T]]:
        return read(old), read(new)

    yield from _listed("scenes", *both(lambda content: named(content.scenes)))
    old_nodes, new_nodes = nodes(reference, old), nodes(source, new)
    yield from _listed("nodes", old_nodes, new_nodes)
    yield from _moves(old_nodes, new_nodes)
    numbers = (
        dict(zip(old_nodes, reached(old), strict=True)),
        dict(zip(new_nodes, reached(new), strict=True)),
    )
    for each in rehung(old, new, *numbers):
        yield _change(
            "altered", each.what, each.where, each.words, before=each.before, after=each.after
        )
    yield from _described("meshes", *both(meshes))
    held = parts(reference, old), parts(source, new, moved)
    painted = held[0].painted, held[1].painted
    yield from _otherwise("meshes", "has its materials elsewhere", *painted)
    yield from _described("materials", *both(materials), can_be_renamed=True)
    yield from _listed("materials", *both(variant_names))
    yield from _listed("libraries", *both(lambda content: content.libraries))
    yield from _listed("images", *both(images))
    yield from _at_vertices(reference, source, moved, held)
    yield from _described("skins", *both(skins))
    bound = followers(reference, old), followers(source, new)
    yield from _otherwise("skins", "moves another part", *bound)
    yield from _described("animations", *both(animations), can_be_renamed=True)
    yield from _otherwise("animations", "moves otherwise", *both(tracks))
    yield from _described("cameras", *both(lambda content: fittings(content.cameras)))
    yield from _described("lights", *both(lambda content: fittings(content.lights)))
    yield from _listed("extensions", *both(lambda content: named(content.extensions_used)))
    extras = both(lambda content: {place: Fact({"data": d}) for place, d in content.extras.items()})
    yield from _described("extras", *extras)


def _open(reference: Content, source: Content) -> Iterator[tuple[ChangeKind, str]]:
    """What could not be compared, because what both files name was sent with neither."""
    lacks = [{each.name for each in c.images if each.data is None} for c in (reference, source)]
    libraries = (reference.libraries, source.libraries)
    unsent = [{name for name, sent in each.items() if not sent} for each in libraries]
    if lacks[0] & lacks[1]:
        yield from (("lost", "images"), ("added", "images"))
    if lacks[0] & lacks[1] or unsent[0] & unsent[1]:
        yield "altered", "materials"


def _at_vertices(
    reference: Asset, source: Asset, moved: Floats | None, held: tuple[Parts, Parts]
) -> Iterator[Change]:
    """What meshes have at their vertices: whether they have it, where, and which values."""
    old, new = reference.content(), source.content()
    valued = fields(reference, old), fields(source, new, moved)
    laid = list(
        _otherwise("uv_sets", "lies otherwise in its texture", uv_layouts(old), uv_layouts(new))
    )
    kinds: dict[str, Callable[[Content], Mapping[str, tuple[str, str]]]] = {
        "uv_sets": lambda content: attributes(content, "TEXCOORD_"),
        "color_sets": lambda content: attributes(content, "COLOR_"),
        "attributes": lambda content: attributes(content, None),
        "morph_targets": targets,
    }
    for what, read in kinds.items():
        there, here = read(old), read(new)
        carried = list(_carried(what, there, here, held))
        if what == "uv_sets":
            carried += laid
        yield from carried
        told = {each.where for each in carried}
        yield from _valued(what, there, here, valued, told)


def _listed(what: str, reference: Mapping[str, T], source: Mapping[str, T]) -> Iterator[Change]:
    """What is in one of two files only."""
    for name in [each for each in reference if each not in source]:
        yield _change("lost", what, name, "is missing", before=name)
    for name in [each for each in source if each not in reference]:
        yield _change("added", what, name, "is new", after=name)


def _carried(
    what: str,
    reference: Mapping[str, tuple[str, str]],
    source: Mapping[str, tuple[str, str]],
    held: tuple[Parts, Parts],
) -> Iterator[Change]:
    """What is in one of two files only, or on more of a mesh there."""
    yield from _listed(what, reference, source)
    for name in [each for each in reference if each in source]:
        old, new = held[0].carried(*reference[name]), held[1].carried(*source[name])
        if old is None or new is None:
            continue
        alike = held[0].painted_alike(held[1], reference[name][0])
        if (words := new.less_than(old, painted_alike=alike)) is not None:
            yield _change("lost", what, name, f"is on {words}", before=name, after=words)
        if (words := old.less_than(new, painted_alike=alike)) is not None:
            told = f"is new on a part; the reference has it on {words}"
            yield _change("added", what, name, told, before=words, after=name)


def _valued(
    what: str,
    reference: Mapping[str, tuple[str, str]],
    source: Mapping[str, tuple[str, str]],
    valued: tuple[Fields, Fields],
    told: Set[str],
) -> Iterator[Change]:
    """What both files have with other values, but for what is told to differ."""
    for name in [each for each in reference if each in source and each not in told]:
        pair = valued[0].differing(valued[1], reference[name], source[name])
        if pair is not None:
            before, after = (each.words() if each else "none that can be read" for each in pair)
            words = "runs otherwise along the mesh" if what == "uv_sets" else "has other values"
            yield _change("altered", what, name, words, before=before, after=after)


def _described(
    what: str,
    reference: Mapping[str, Fact],
    source: Mapping[str, Fact],
    *,
    can_be_renamed: bool = False,
) -> Iterator[Change]:
    """What is in one of two files only, has another name there, or other properties."""
    lost = {name: fact for name, fact in reference.items() if name not in source}
    added = {name: fact for name, fact in source.items() if name not in reference}
    for old, new in _renamed(lost, added) if can_be_renamed else ():
        words = f"is called '{new[:_SHOWN]}' now"
        yield _change("renamed", what, old, words, before=old, after=new)
    yield from _listed(what, lost, added)
    for name in [each for each in reference if each in source]:
        for key, before, after in reference[name].differences(source[name]):
            words = f"differs in {key}: {after}; the reference has {before}"
            yield _change("altered", what, name, words, before=before, after=after)


def _renamed(lost: dict[str, Fact], added: dict[str, Fact]) -> Iterator[tuple[str, str]]:
    """Take what differs in nothing but its name out of both."""
    by_content: dict[str, list[str]] = {}
    for name, fact in added.items():
        by_content.setdefault(fact.identity, []).append(name)
    for old in list(lost):
        names = by_content.get(lost[old].identity)
        if names:
            new = names.pop(0)
            del lost[old], added[new]
            yield old, new


def _moves(reference: Mapping[str, Placed], source: Mapping[str, Placed]) -> Iterator[Change]:
    for path in [each for each in reference if each in source]:
        if not reference[path].is_at(source[path]):
            yield _change(
                "moved",
                "nodes",
                path,
                "is placed otherwise",
                before=reference[path].words(),
                after=source[path].words(),
            )


class _Comparable(Protocol):
    """What can be told to be about the same, though not to the last digit."""

    def is_like(self, other: Any) -> bool: ...

    def words(self) -> str: ...


def _otherwise(
    what: str,
    words: str,
    reference: Mapping[str, _Comparable],
    source: Mapping[str, _Comparable],
) -> Iterator[Change]:
    """What both files have and is not about the same."""
    for name in [each for each in reference if each in source]:
        if not reference[name].is_like(source[name]):
            before, after = reference[name].words(), source[name].words()
            yield _change("altered", what, name, words, before=before, after=after)


def _change(
    kind: ChangeKind,
    what: str,
    name: str,
    words: str,
    *,
    before: str | None = None,
    after: str | None = None,
) -> Change:
    one = _SINGULARS.get(what, what.removesuffix("s")).replace("_", " ")
    return Change(
        kind=kind,
        what=what,
        where=name,
        reference=before,
        source=after,
        words=f"{one} '{name[:_SHOWN]}' {words}",
    )
