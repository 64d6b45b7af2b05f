"""What a pair of meshes suggests may be wrong with it, told before anyone wonders at the result.

Nothing here refuses a pair: each sentence names a defect that a refinement survives but
cannot mend.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from meshcone.quality.records import Validity
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats, Ints, row_dot

_SAMPLES = 5000
_SEED = 0
# Distances are relative to the reference's radius.
_FAR = 0.1
_WORTH_TELLING = 0.05
_OTHER_UNITS = 5.0
_LEAST_OVERLAP = 0.1
_FLAT = 0.05
# Noise and thin parts turn many normals around; more than this share is another matter.
_INSIDE_OUT = 0.6


def data_warnings(
    source: Mesh, reference: Mesh, found: Validity, reference_found: Validity
) -> list[str]:
    """Describe what may be wrong with a pair, a sentence each.

    Args:
        source: in the reference's frame.
        reference: in its own frame, where its radius is 1.
        found: what was counted on the source.
        reference_found: what was counted on the reference.
    """
    unusable = [
        f"The {name} holds no surface."
        for name, mesh in (("source", source), ("reference", reference))
        if not _has_surface(mesh)
    ]
    if unusable:
        return unusable
    placement = list(_placement(source, reference))
    # Distances say nothing new of meshes that lie in different places.
    fit = [] if placement else _fit(source, reference)
    return [
        *placement,
        *fit,
        *_defects("source", source, found),
        *_defects("reference", reference, reference_found),
        *_pieces(found.components, reference_found.components),
    ]


def _has_surface(mesh: Mesh) -> bool:
    used = mesh.vertices[mesh.faces]
    return bool(len(used) and np.isfinite(used).all() and mesh.face_areas.sum() > 0)


def _placement(source: Mesh, reference: Mesh) -> Iterator[str]:
    (low, high), (reference_low, reference_high) = _box(source), _box(reference)
    extent, reference_extent = high - low, reference_high - reference_low
    ratio = float(extent.max() / reference_extent.max())
    if not 1 / _OTHER_UNITS <= ratio <= _OTHER_UNITS:
        size = f"{ratio:.3g} times" if ratio > 1 else f"1/{1 / ratio:.3g} of"
        yield (
            f"The source is {size} the size of the reference: they may be in different units, "
            "which aligning by similarity can mend."
        )
        return
    shared = np.minimum(high, reference_high) - np.maximum(low, reference_low)
    smaller = np.minimum(extent, reference_extent)
    shares = (shared + _FLAT) / (smaller + _FLAT)  # a flat mesh has an axis without extent
    axis = int(np.argmin(shares))
    if shares[axis] < _LEAST_OVERLAP:
        yield (
            f"Along {'xyz'[axis]} the bounding boxes of source and reference overlap "
            f"by {_percent(max(float(shares[axis]), 0))} only: the meshes may need to be aligned "
            "first."
        )


def _fit(source: Mesh, reference: Mesh) -> list[str]:
    used = _used(source)
    chosen = used[:: -(-len(used) // _SAMPLES)]
    closest = SurfaceTree(reference).closest(source.vertices[chosen])
    samples = sample_surface(reference, _SAMPLES, _SEED)
    missed = SurfaceTree(source).closest(samples.points).distances > _FAR
    far = closest.distances > _FAR
    sentences = []
    if far.mean() > _WORTH_TELLING:
        sentences.append(
            f"{_percent(far.mean())} of the source's vertices are farther from the reference than "
            "a tenth of its radius: where the reference has a hole or lacks a part, they have "
            "nothing to follow."
        )
    if missed.mean() > _WORTH_TELLING:
        sentences.append(
            f"{_percent(missed.mean())} of the reference's surface is farther from the source than "
            "a tenth of its radius: where the source has a hole or lacks a part, refining cannot "
            "fill it, because it adds no faces."
        )
    normals = reference.face_normals[closest.faces]
    opposed = row_dot(source.vertex_normals[chosen], normals)[~far] < 0
    if len(opposed) and opposed.mean() > _INSIDE_OUT:
        sentences.append(
            f"{_percent(opposed.mean())} of the source's normals oppose the reference's: one of "
            "the two is inside out."
        )
    return sentences


def _defects(name: str, mesh: Mesh, validity: Validity) -> Iterator[str]:
    isolated = len(mesh.vertices) - len(_used(mesh))
    if validity.non_manifold_edges:
        yield (
            f"The {name} has {_count(validity.non_manifold_edges, 'edge')} where more than two "
            "faces meet."
        )
    if validity.opposed_edges:
        yield (
            f"The {name} has {_count(validity.opposed_edges, 'edge')} across which neighbouring "
            "faces turn their outsides in opposite directions."
        )
    if validity.duplicate_faces:
        yield (
            f"The {name} has {_count(validity.duplicate_faces, 'face')} with the same corners as "
            "another."
        )
    if validity.self_intersections:
        yield (
            f"The {name} has {_count(validity.self_intersections, 'pair')} of faces that pass "
            "through each other."
        )
    if validity.degenerate_faces:
        yield f"The {name} has {_count(validity.degenerate_faces, 'face')} without area."
    if isolated:
        yield f"The {name} has {_count(isolated, 'vertex', 'vertices')} that no face uses."


def _pieces(pieces: int, reference_pieces: int) -> Iterator[str]:
    if pieces != reference_pieces:
        yield (
            f"The source is in {_count(pieces, 'piece')} and the reference in "
            f"{_count(reference_pieces, 'piece')}: pieces without a counterpart follow whatever "
            "is closest."
        )


def _box(mesh: Mesh) -> tuple[Floats, Floats]:
    used = mesh.vertices[_used(mesh)]
    return used.min(axis=0), used.max(axis=0)


def _used(mesh: Mesh) -> Ints:
    """Return the vertices some face uses, ascending."""
    return np.flatnonzero(np.bincount(mesh.faces.ravel(), minlength=len(mesh.vertices)))


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _count(number: int, one: str, many: str | None = None) -> str:
    return f"{number:,} {one if number == 1 else many or one + 's'}"
