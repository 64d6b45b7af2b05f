"""The distances of each part of two surfaces to all of the other surface.

Every part is sampled, however small it is. Distances are to the whole of the other surface,
so that a part that has another name there is not missing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from meshcone.quality.directions import directed, histogram, inside, signed_distances
from meshcone.quality.records import Directed, Division, Part, PerPart
from meshcone.surface import Frame, Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Bools, Floats, Ints, row_lengths

LISTED = 200
# Samples of one part, and of all parts together, besides those that their areas ask for.
_MOST, _LEAST, _TOGETHER = 256, 4, 50_000
_SEED = 0
# A part of whose area most lies farther from the other surface than this share of the part's
# own size is not there; less is enough where the other file has most names, and not this one.
# The distance must stand out from what is usual between the two.
_OWN_SIZE, _OWN_SIZE_UNNAMED = 0.25, 0.05
_NAMES_KEPT = 0.5
_USUAL = 3.0
_AREA = 0.6
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Partition:
    """Which part each face of a mesh belongs to.

    Attributes:
        names: of the parts.
        labels: (m,) the part of each face.
    """

    names: tuple[str, ...]
    labels: Ints


@dataclass(frozen=True)
class PartSamples:
    """Samples and vertices of every part of a mesh, and how far they are from another mesh.

    Attributes:
        points: (k, 3) in the frame, sorted by part, in each the samples first.
        distances: (k,) to the other mesh.
        parts: (k,) the part of each.
        sampled: (p,) samples of each part, none where it has no area.
        areas: (p,) of each part.
    """

    partition: Partition
    points: Floats
    distances: Floats
    parts: Ints
    sampled: Ints
    areas: Floats

    @staticmethod
    def of(
        mesh: Mesh,
        partition: Partition,
        other: SurfaceTree,
        samples: int,
        *,
        vertices: bool = True,
    ) -> PartSamples:
        """Sample every part that has an area.

        Args:
            mesh: in the frame.
            partition: its parts.
            other: the surface to measure to.
            samples: how many are shared out by area, besides some for every part.
            vertices: whether to look from the vertices too, where a spike is seen that no
                sample hits.
        """
        count = len(partition.names)
        areas: Floats = np.zeros(count)
        np.add.at(areas, partition.labels, mesh.face_areas)
        least = int(np.clip(_TOGETHER // max(count, 1), _LEAST, _MOST))
        shared = np.round(samples * areas / areas.sum())
        wanted = np.where(areas > 0, least + shared, 0).astype(np.int64)
        points, parts = _samples(mesh, partition.labels, areas, wanted)
        if vertices:
            corners, owners = _vertices(mesh, partition.labels)
            owned = wanted[owners] > 0
            points = np.concatenate([points, mesh.vertices[corners[owned]]])
            parts = np.concatenate([parts, owners[owned]])
        order = np.argsort(parts, kind="stable")
        points = points[order]
        distances = other.closest(points).distances
        return PartSamples(partition, points, distances, parts[order], wanted, areas)

    @cached_property
    def starts(self) -> Ints:
        """(p + 1,) where the points of each part begin."""
        return np.searchsorted(self.parts, np.arange(len(self.sampled) + 1))

    @cached_property
    def is_sample(self) -> Bools:
        """(k,) which points are samples."""
        place = np.arange(len(self.parts)) - self.starts[self.parts]
        return place < self.sampled[self.parts]

    @cached_property
    def usual(self) -> float:
        """The median distance over the area."""
        shares = np.where(self.is_sample, (self.areas / np.maximum(self.sampled, 1))[self.parts], 0)
        order = np.argsort(self.distances)
        covered = np.cumsum(shares[order])
        return float(self.distances[order[np.searchsorted(covered, covered[-1] / 2)]])

    @cached_property
    def means(self) -> Floats:
        """(p,) mean distance of each part; 0 where it has no area."""
        weights = np.where(self.is_sample, self.distances, 0.0)
        summed = np.bincount(self.parts, weights, minlength=len(self.sampled))
        return np.asarray(summed / np.maximum(self.sampled, 1))

    def absent(self, names: Collection[str]) -> Bools:
        """(p,) which parts the other surface has nothing of.

        Args:
            names: of the other surface's parts.
        """
        known = np.array([name in names for name in self.partition.names])
        keeps_names = np.mean(known[self.sampled > 0]) >= _NAMES_KEPT
        share = np.where(~known & keeps_names, _OWN_SIZE_UNNAMED, _OWN_SIZE)
        reach = np.maximum(share * self._sizes, _USUAL * self.usual + _ROUNDING)
        far = self.distances > reach[self.parts]
        beyond = np.bincount(self.parts, far & self.is_sample, minlength=len(self.sampled))
        return np.asarray((self.sampled > 0) & (beyond >= _AREA * self.sampled))

    @cached_property
    def _sizes(self) -> Floats:
        """(p,) half the diagonal of each part's box."""
        sizes = np.zeros(len(self.sampled))
        given = np.flatnonzero(self.sampled)
        if len(given):
            starts = self.starts[given]
            low = np.minimum.reduceat(self.points, starts)
            high = np.maximum.reduceat(self.points, starts)
            sizes[given] = row_lengths(high - low) / 2
        return sizes

    def rows_of(self, part: int, values: Bools) -> Bools:
        """Those of (k,) values that are of a part's samples."""
        start = self.starts[part]
        return values[start : start + self.sampled[part]]

    def of_part(self, part: int) -> tuple[Floats, Floats, int]:
        """Points and distances of one part, and how many of them are samples."""
        rows = slice(self.starts[part], self.starts[part + 1])
        return self.points[rows], self.distances[rows], int(self.sampled[part])


def _samples(mesh: Mesh, labels: Ints, areas: Floats, wanted: Ints) -> tuple[Floats, Ints]:
    """Points spread over the area of every part, and their parts."""
    order = np.argsort(labels, kind="stable")
    sorted_mesh = Mesh(mesh.vertices, mesh.faces[order])
    ends = np.cumsum(areas)
    parts = np.repeat(np.arange(len(areas)), wanted)
    within = np.arange(len(parts)) - np.repeat(np.cumsum(wanted) - wanted, wanted)
    shares = (within + 0.5) / wanted[parts]
    along = (ends[parts] - areas[parts] * (1 - shares)) / ends[-1]
    return sample_surface(sorted_mesh, len(parts), _SEED, along=along).points, parts


def _vertices(mesh: Mesh, labels: Ints) -> tuple[Ints, Ints]:
    """Vertices of every part, and the parts: a vertex that several have is there for each."""
    count = len(mesh.vertices)
    keys = np.unique(np.repeat(labels, 3) * count + mesh.faces.ravel())
    owners, vertices = np.divmod(keys, count)
    return vertices, owners


@dataclass(frozen=True)
class _Named:
    """A part by its name, and its number in either partition, if it is there."""

    name: str
    reference: int | None
    mesh: int | None


def distances_per_part(
    by: Division,
    mesh: PartSamples,
    reference: PartSamples,
    frame: Frame,
    bound: float | None,
    closed: Mesh | None,
) -> PerPart:
    """Describe every part that either surface has, the worst first.

    Args:
        by: what the parts are.
        mesh: parts of the judged mesh, with distances to the reference.
        reference: parts of the reference, with distances to the judged mesh.
        frame: that leads back to model units.
        bound: relative to the radius.
        closed: the reference, if it is closed.
    """
    named = list(_named(mesh, reference))
    lacking = reference.absent(_numbers(mesh).keys())
    besides = mesh.absent(_numbers(reference).keys())
    enclosed = None if closed is None else inside(mesh.points, closed)

    def state(each: _Named) -> tuple[bool, bool, float]:
        missing = each.reference is not None and bool(lacking[each.reference])
        extra = each.mesh is not None and bool(besides[each.mesh])
        means = [
            float(side.means[part])
            for side, part in ((reference, each.reference), (mesh, each.mesh))
            if part is not None
        ]
        return missing, extra, max(means)

    ranked = sorted(named, key=state, reverse=True)

    def part(each: _Named) -> Part:
        missing, extra, _ = state(each)
        there = _empty() if each.reference is None else reference.of_part(each.reference)
        here = _empty() if each.mesh is None else mesh.of_part(each.mesh)
        _, distances, samples = here
        return Part(
            name=each.name,
            found="missing" if missing else "extra" if extra else "both",
            missing=_described(there, frame, bound),
            extra=_described(here, frame, bound),
            signed=signed_distances(distances[:samples], mesh.rows_of(each.mesh, enclosed))
            if enclosed is not None and each.mesh is not None
            else None,
            histogram=histogram(there[1][: there[2]], distances[:samples]),
        )

    return PerPart(
        by=by,
        count=len(named),
        missing=int(np.count_nonzero(lacking)),
        extra=int(np.count_nonzero(besides)),
        parts=tuple(map(part, ranked[:LISTED])),
    )


def _named(mesh: PartSamples, reference: PartSamples) -> Iterator[_Named]:
    here = _numbers(mesh)
    there = _numbers(reference)
    for name in dict.fromkeys([*there, *here]):
        yield _Named(name, there.get(name), here.get(name))


def _numbers(samples: PartSamples) -> dict[str, int]:
    return {
        name: part for part, name in enumerate(samples.partition.names) if samples.sampled[part]
    }


def _empty() -> tuple[Floats, Floats, int]:
    return np.zeros((0, 3)), np.zeros(0), 0


def _described(
    found: tuple[Floats, Floats, int], frame: Frame, bound: float | None
) -> Directed | None:
    points, distances, samples = found
    return directed(points, distances, samples, frame, bound) if samples else None
