"""From the cones a user asks for to the cone families of a round."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.errors import InputError
from meshcone.options import ConeOptions, EdgeCapOptions
from meshcone.program.cones import ConeFamily, DisplacementCaps, EdgeCaps, Pins, ToleranceBand
from meshcone.program.pulls import PlanePull
from meshcone.program.staying import Staying
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints


@dataclass(frozen=True)
class SourceLabels:
    """What the file says of the source beyond its geometry.

    Attributes:
        regions: (m,) material or group of each face.
        weld: (r,) welded vertex of each vertex of the file, −1 for an unused one.
        fixed: (n,) welded vertices that stay whatever is pinned, or None for none.
        listed: vertices of the file to pin besides those in the options, or None for none.
    """

    regions: Ints
    weld: Ints
    fixed: Bools | None = None
    listed: Ints | None = None


@dataclass(frozen=True)
class RequestedCones:
    """Everything asked for, in the frame; what depends on a round is added by :meth:`families`.

    Attributes:
        edge_caps: the caps on edges: the default's and the user's, whichever is tighter.
        displacement: caps on displacement, or None.
        pins: the pinned vertices, or None.
        band: half-width of the tolerance band, or None.
        staying: the side of the reference to stay on, or None.
        fixed: (n,) vertices that stay whatever is asked, or None for none.
    """

    edge_caps: EdgeCaps
    displacement: DisplacementCaps | None
    pins: Pins | None
    band: float | None
    staying: Staying | None = None
    fixed: Bools | None = None

    def families(self, forward: PlanePull, moving: Mesh) -> list[ConeFamily]:
        """List the families of a round that starts at ``moving``, as ``forward`` pulls there."""
        families: list[ConeFamily] = [self.edge_caps]
        if self.displacement is not None:
            families.append(self.displacement)
        if self.pins is not None:
            families.append(self.pins)
        if self.band is not None:
            held = np.arange(len(forward.targets))
            if self.fixed is not None:
                held = held[~self.fixed]
            targets, normals = forward.targets[held], forward.normals[held]
            families.append(ToleranceBand(held[:, None], targets, normals, self.band))
        if self.staying is not None:
            families += self.staying.families(moving, self.fixed)
        return families

    def pinned(self, positions: Floats) -> Floats:
        """Return (n, 3) positions with those that are pinned where they are pinned, to the bit.

        A solver leaves them within its tolerance of there.
        """
        if self.pins is None:
            return positions
        exact = positions.copy()
        exact[self.pins.vertices[:, 0]] = self.pins.centres
        return exact

    def strays(self, source: Mesh) -> bool:
        """Whether a mesh is somewhere on the wrong side, or too near."""
        held = [] if self.staying is None else self.staying.families(source, self.fixed)
        return any(family.unmet(source.vertices) for family in held)


def resolve_cones(
    source: Mesh,
    default_factor: float,
    asked: ConeOptions,
    radius: float,
    labels: SourceLabels,
    staying: Staying | None = None,
) -> RequestedCones:
    """Resolve the user's request against the input.

    Args:
        source: the input in the frame.
        default_factor: the default cap's multiple of the longest edge at either end.
        asked: the request.
        radius: the frame's radius in model units.
        labels: regions and vertex numbering of the file.
        staying: the side of the reference to stay on, if one was asked for.

    Raises:
        InputError: a pinned vertex is not in the file.
    """
    caps = EdgeCaps.relative(source, default_factor).caps
    if asked.edge_cap is not None:
        caps = np.minimum(caps, _asked_caps(source, asked.edge_cap, radius))
    if labels.fixed is not None:  # nothing is asked of what stays whatever is asked
        staying_edges = labels.fixed[source.edges].all(axis=1)
        caps = np.where(staying_edges, np.maximum(caps, source.edge_lengths), caps)
    pinned = _pinned_vertices(source, asked, labels)
    displacement = asked.max_displacement
    return RequestedCones(
        edge_caps=EdgeCaps(source.edges, caps),
        displacement=None
        if displacement is None
        else DisplacementCaps.uniform(source.vertices, displacement.in_frame(radius)),
        pins=Pins.at(source.vertices, pinned) if len(pinned) else None,
        band=None if asked.tolerance_band is None else asked.tolerance_band.in_frame(radius),
        staying=staying,
        fixed=labels.fixed,
    )


def _asked_caps(source: Mesh, asked: EdgeCapOptions, radius: float) -> Floats:
    if asked.length is not None:
        return np.full(len(source.edges), asked.length.in_frame(radius))
    if asked.times_input is not None:
        return asked.times_input * source.edge_lengths
    assert asked.times_local_median is not None  # noqa: S101 - the options' validator has seen to it
    medians = _local_medians(source)[source.edges]
    return np.asarray(asked.times_local_median * medians.max(axis=1))


def _local_medians(source: Mesh) -> Floats:
    """Return the median length of the edges at each vertex, (n,); 0 at isolated vertices."""
    ends = source.edges.ravel()
    lengths = np.repeat(source.edge_lengths, 2)
    order = np.lexsort((lengths, ends))
    degree = np.bincount(ends, minlength=len(source.vertices))
    first = np.concatenate([[0], np.cumsum(degree)[:-1]])
    medians = np.zeros(len(source.vertices))
    used = degree > 0
    lower = lengths[order[first[used] + (degree[used] - 1) // 2]]
    upper = lengths[order[first[used] + degree[used] // 2]]
    medians[used] = (lower + upper) / 2
    return medians


def _pinned_vertices(source: Mesh, asked: ConeOptions, labels: SourceLabels) -> Ints:
    none = np.zeros(len(source.vertices), dtype=bool)
    chosen = none if labels.fixed is None else labels.fixed.copy()
    for index in asked.pin.vertices:
        if index >= len(labels.weld):
            raise InputError(
                f"option 'cones.pin.vertices' names vertex {index}; "
                f"the source has {len(labels.weld)}, counted from 0"
            )
        if labels.weld[index] >= 0:
            chosen[labels.weld[index]] = True
    if labels.listed is not None:
        welded = labels.weld[labels.listed]
        chosen[welded[welded >= 0]] = True
    if asked.pin.boundary or asked.pin.region_borders:
        regions = labels.regions if asked.pin.region_borders else np.zeros_like(labels.regions)
        chosen[_border_vertices(source, regions)] = True
    return np.flatnonzero(chosen)


def _border_vertices(source: Mesh, regions: Ints) -> Ints:
    """Find the vertices of edges with one face, or with faces of different regions."""
    faces = source.faces
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    keys = ends[:, 0] * len(source.vertices) + ends[:, 1]
    label = np.tile(regions, 3)
    order = np.argsort(keys, kind="stable")
    _, first, uses = np.unique(keys[order], return_index=True, return_counts=True)
    lowest = np.minimum.reduceat(label[order], first)
    highest = np.maximum.reduceat(label[order], first)
    border = (uses == 1) | (lowest != highest)
    return np.unique(ends[order[first[border]]])
