"""Divides the triangles of primitives, with every attribute of every vertex that is new."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessors, decode
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.divisible import check_mesh, check_primitive, check_vertices
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.interpolate import encoded_weights, extended, influences
from meshcone.assets.gltf.model import Model
from meshcone.assets.gltf.primitives import Primitive
from meshcone.assets.gltf.scene import PlacedPrimitive
from meshcone.assets.gltf.tables import Tables
from meshcone.assets.weld import WeldedSurface
from meshcone.errors import InputError
from meshcone.surface.subdivision import DividedFaces, Subdivision


@dataclass(frozen=True)
class DividedDocument:
    """A document with triangles divided.

    Attributes:
        lost: the largest share of a vertex's skin weights that had no room at a new vertex.
    """

    document: Document
    buffers: Buffers
    lost: float


def divide_primitives(
    model: Model, surface: WeldedSurface, subdivision: Subdivision
) -> DividedDocument:
    """Divide the triangles of a scene.

    Primitives whose vertices are the same, with all their attributes, stay so. A vertex that
    two triangles share has one new vertex for both on their common edge; where a seam splits
    it, either side has its own. A primitive of which nothing is divided stays as it is.

    Args:
        model: the file, with nothing in it compressed.
        surface: the surface welded from its scene.
        subdivision: of the surface's faces.

    Raises:
        InputError: what something in the file says of a mesh or primitive does not hold for a
            divided one, or a mesh is divided in one way at one node and in another at the next.
        LimitError: the document grows larger than one may be that is sent.
    """
    parts = _divided_parts(model, surface, subdivision)
    meshes = model.document.root.children("meshes")
    for part in parts:
        check_mesh(meshes[_mesh(part.element)])
        check_primitive(part.element)
        check_vertices(part.primitive, model.accessors)
    draft = Draft(model.document, model.accessors.buffers, model.limits)
    tables = Tables(draft, model.document, model.accessors, [part.element for part in parts])
    pools: dict[object, list[_Part]] = defaultdict(list)
    for part in parts:
        pools[part.vertices].append(part)
    lost = 0.0
    for pool in pools.values():
        lost = max(lost, _Pool(model.accessors, tables, pool).write(draft))
    document, buffers = draft.finish()
    return DividedDocument(document, buffers, lost)


@dataclass(frozen=True)
class _Part:
    """A primitive and how its triangles are divided, as its indices list them."""

    primitive: Primitive
    subdivision: Subdivision

    @property
    def element(self) -> Element:
        """Where it is in the document."""
        return self.primitive.element

    @cached_property
    def attributes(self) -> dict[str, int]:
        """Accessors of its vertices."""
        found = self.element.child("attributes")
        return {} if found is None else _indices(found)

    @cached_property
    def targets(self) -> list[dict[str, int]]:
        """Accessors of its morph targets."""
        return [_indices(target) for target in self.element.children("targets")]

    @property
    def vertices(self) -> object:
        """What makes its vertices those of another primitive."""
        sets = (self.attributes, *self.targets)
        return tuple(tuple(sorted(accessors.items())) for accessors in sets)

    def divides_like(self, other: _Part) -> bool:
        """Whether the same triangles are divided in the same way."""
        mine, others = self.subdivision, other.subdivision
        return all(
            np.array_equal(getattr(mine, name), getattr(others, name))
            for name in ("parents", "corners", "slots")
        )


def _divided_parts(model: Model, surface: WeldedSurface, subdivision: Subdivision) -> list[_Part]:
    """The primitives some triangle of which is divided, in the order of the scene."""
    face_of_row = np.full(len(surface.triangles), -1, dtype=np.int64)
    face_of_row[surface.kept] = np.arange(len(surface.kept))
    parts: dict[str, _Part] = {}
    start = 0
    for placed in model.scene.primitives:
        rows = np.arange(start, start + len(placed.triangles))
        start += len(rows)
        mirrored = model.scene.blocks[placed.block].placement.mirrored
        part = _part(placed, face_of_row[rows], subdivision, mirrored=mirrored)
        known = parts.setdefault(part.element.pointer, part)
        if not part.divides_like(known):
            raise InputError(
                "the primitive is drawn more than once, and would be divided in different ways",
                place=part.element.pointer,
            )
    return [part for part in parts.values() if part.subdivision.divided.any()]


def _part(
    placed: PlacedPrimitive,
    faces: NDArray[np.int64],
    subdivision: Subdivision,
    *,
    mirrored: bool,
) -> _Part:
    """A primitive at one node.

    Args:
        placed: it.
        faces: (k,) the face that each of its triangles is, −1 for one without area.
        subdivision: of all faces.
        mirrored: whether the node turns triangles over, so that they are read the other way.
    """
    primitive = placed.primitive
    if len(placed.triangles) != len(primitive.triangles):
        if subdivision.divided[faces[faces >= 0]].any():
            raise InputError(
                "the primitive has triangles with corners that are nowhere: they cannot be kept "
                "beside divided ones",
                place=primitive.element.pointer,
            )
        faces = np.full(len(primitive.triangles), -1, dtype=np.int64)
    row_of_face = np.full(subdivision.sources, -1, dtype=np.int64)
    row_of_face[faces[faces >= 0]] = np.flatnonzero(faces >= 0)
    mine = subdivision.renumbered(row_of_face, len(primitive.triangles))
    return _Part(
        primitive,
        mine.mirrored() if mirrored else mine,
    )


class _Pool:
    """Primitives with the same vertices."""

    def __init__(self, accessors: Accessors, tables: Tables, parts: list[_Part]) -> None:
        self._accessors, self._tables, self._parts = accessors, tables, parts
        self._lost = 0.0

    def write(self, draft: Draft) -> float:
        """Write vertices and indices; return the largest share of skin weights that was lost."""
        count = self._parts[0].primitive.position.count
        triangles = np.concatenate([part.primitive.triangles for part in self._parts])
        divided = _together([part.subdivision for part in self._parts]).over(triangles, count)
        first = self._parts[0]
        attributes = dict(self._written(first.attributes, divided, morphs=False))
        targets = [dict(self._written(t, divided, morphs=True)) for t in first.targets]
        start = 0
        for part in self._parts:
            end = start + len(part.subdivision.parents)
            path = _path(part.element)
            indices = self._tables.indices(part.element, divided.faces[start:end].ravel())
            draft.put((*path, "indices"), indices)
            if part.element.integer("mode") not in (None, 4):
                draft.put((*path, "mode"), 4)
            _point_to(draft, (*path, "attributes"), part.attributes, attributes)
            for number, (had, has) in enumerate(zip(part.targets, targets, strict=True)):
                _point_to(draft, (*path, "targets", number), had, has)
            start = end
        return self._lost

    def _written(
        self, names: dict[str, int], points: DividedFaces, *, morphs: bool
    ) -> Iterator[tuple[str, int]]:
        skins = sorted(name for name in names if name.startswith("JOINTS_"))
        skins = [name for name in skins if name.replace("JOINTS", "WEIGHTS") in names]
        if skins and not morphs:
            yield from self._skin(names, skins, points)
        done = {*skins, *(name.replace("JOINTS", "WEIGHTS") for name in skins)}
        for name, index in names.items():
            if name in done and not morphs:
                continue
            accessor = self._accessors.describe(index)
            stored = self._accessors.read(accessor)
            table = extended(name, accessor, stored, points, morphs=morphs)
            yield name, self._tables.vertices(accessor, table)

    def _skin(
        self, names: dict[str, int], skins: list[str], points: DividedFaces
    ) -> Iterator[tuple[str, int]]:
        joints = [self._accessors.describe(names[name]) for name in skins]
        follow = [name.replace("JOINTS", "WEIGHTS") for name in skins]
        weights = [self._accessors.describe(names[name]) for name in follow]
        numbers, shares = ([self._accessors.read(a) for a in each] for each in (joints, weights))
        decoded = [decode(s, a.normalized) for s, a in zip(shares, weights, strict=True)]
        found = influences(
            np.concatenate(numbers, axis=1).astype(np.int64),
            np.concatenate(decoded, axis=1),
            points,
        )
        self._lost = max(self._lost, found.lost)
        new = encoded_weights(found.weights, weights[0].component)
        for place, (name, weight_name) in enumerate(zip(skins, follow, strict=True)):
            columns = slice(4 * place, 4 * place + 4)
            old, of_weights = numbers[place], weights[place]
            joined = np.concatenate([old, found.joints[:, columns].astype(old.dtype)])
            yield name, self._tables.vertices(joints[place], joined)
            if of_weights.component != weights[0].component:
                raise InputError(
                    "the sets of skin weights are stored in different types",
                    place=of_weights.element.pointer,
                )
            table = np.concatenate([shares[place], new[:, columns]])
            yield weight_name, self._tables.vertices(of_weights, table)


def _together(parts: list[Subdivision]) -> Subdivision:
    """One subdivision of the triangles of several primitives, one after the other."""
    starts = np.cumsum([0, *(part.sources for part in parts)])
    parents = [part.parents + start for part, start in zip(parts, starts[:-1], strict=True)]
    corners = np.concatenate([part.corners for part in parts])
    firsts = np.cumsum([0, *(part.slots.size for part in parts)])[:-1]
    slots = np.concatenate([p.slots + f for p, f in zip(parts, firsts, strict=True)])
    exponent = parts[0].exponent
    return Subdivision(int(starts[-1]), np.concatenate(parents), corners, exponent, slots)


def _path(primitive: Element) -> tuple[str | int, ...]:
    """Where a primitive is in the document."""
    _, meshes, mesh, primitives, number = primitive.pointer.split("/")
    return meshes, int(mesh), primitives, int(number)


def _indices(named: Element) -> dict[str, int]:
    """Accessors by name; a whole number may be written as 3.0."""
    return {name: int(index) for name, index in named.value.items()}


def _mesh(primitive: Element) -> int:
    """The mesh that a primitive is of."""
    return int(primitive.pointer.split("/")[2])


def _point_to(
    draft: Draft, path: tuple[str | int, ...], had: dict[str, int], has: dict[str, int]
) -> None:
    for name, index in has.items():
        if had[name] != index:
            draft.put((*path, name), index)
