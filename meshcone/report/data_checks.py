"""What a pair of meshes suggests may be wrong with it, told before anyone wonders at the result.

Nothing here refuses a pair: each warning names a defect that a refinement survives but
cannot mend.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from meshcone.appearance.records import Appearance
from meshcone.notices import COLORS, FITS, OF_PAIRS, Code, Side, Told, WarningRecord, warning
from meshcone.quality.parts import Partition
from meshcone.quality.records import Validity
from meshcone.report.piece_checks import PartedMesh, piece_warnings
from meshcone.report.pose_checks import find_pose, size_in_words, unit_factor
from meshcone.surface import Frame, Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats, Ints, row_dot
from meshcone.surface.motion import MotionSearch
from meshcone.surface.similarity import transform_points

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
# Normals of fewer vertices than this share say nothing of the mesh.
_MOST_COMPARED = 0.5
# A share of the area to the power 3/2: what is flat and closed encloses less.
_NO_VOLUME = 1e-6

_DEFECTS = frozenset(
    {
        Code.EDGES_NON_MANIFOLD,
        Code.EDGES_OPPOSED,
        Code.FACES_CROSSING,
        Code.FACES_DEGENERATE,
        Code.FACES_DUPLICATE,
        Code.SURFACE_INSIDE_OUT,
        Code.VERTICES_ISOLATED,
    }
)


def data_warnings(
    source: Mesh,
    reference: Mesh,
    found: Validity,
    reference_found: Validity,
    frame: Frame,
    parts: tuple[Partition, Partition],
) -> Told:
    """Describe what may be wrong with a pair.

    Args:
        source: in the reference's frame.
        reference: in its own frame, where its radius is 1.
        found: what was counted on the source.
        reference_found: what was counted on the reference.
        frame: that leads back to model units.
        parts: what the files name, of source and reference.
    """
    sides: tuple[tuple[Side, Mesh], ...] = (("source", source), ("reference", reference))
    unusable = [
        warning(Code.SURFACE_EMPTY, side, f"The {side} holds no surface.")
        for side, mesh in sides
        if not _has_surface(mesh)
    ]
    if unusable:
        return Told(unusable, OF_PAIRS - COLORS | _DEFECTS)
    return (
        _pose_and_fit(source, reference, frame, parts)
        + defects("source", source, found)
        + defects("reference", reference, reference_found)
        + Told(list(_pieces(found.components, reference_found.components)))
    )


def appearance_warnings(appearance: Appearance | None, *, asked: bool) -> Told:
    """Say that colours were not compared, where they could not be.

    Args:
        appearance: what was compared; None where it was not asked for, or without colours.
        asked: whether colours were to be compared.
    """
    if appearance is None or appearance.why_not_tested is None:
        return Told([], frozenset() if asked else COLORS)
    words = f"Colours were not compared: {appearance.why_not_tested}."
    return Told([warning(Code.COLORS_NOT_COMPARED, "pair", words)])


def _pose_and_fit(
    source: Mesh, reference: Mesh, frame: Frame, parts: tuple[Partition, Partition]
) -> Told:
    names, reference_names = parts
    there = PartedMesh(reference, SurfaceTree(reference), reference_names)

    def fit(placed: Mesh, tree: SurfaceTree) -> Told:
        here = PartedMesh(placed, tree, names)
        return _fit(placed, tree, reference, there.tree) + piece_warnings(here, there, frame)

    tree, reference_tree = SurfaceTree(source), there.tree
    pose = find_pose(MotionSearch(source, reference, tree, reference_tree), frame)
    if pose is not None:
        # What else there is to say is said of the shapes where they agree best.
        back = _carried(source, pose.to_reference)
        return Told(list(pose.warnings)) + fit(back, SurfaceTree(back))
    # Distances say nothing new of meshes that lie in different places, and neither do normals.
    misplaced = list(placement(source, reference))
    if not misplaced:
        return fit(source, tree)
    # Where boxes of other sizes lie says nothing either.
    return Told(misplaced, FITS | ({Code.POSE_APART} - {each.code for each in misplaced}))


def _carried(mesh: Mesh, matrix: Floats) -> Mesh:
    """A mesh moved by a (4, 4) similarity; what was outside of it is outside after mirroring."""
    faces = mesh.faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else mesh.faces
    return Mesh(transform_points(matrix, mesh.vertices), faces)


def _has_surface(mesh: Mesh) -> bool:
    used = mesh.vertices[mesh.faces]
    return bool(len(used) and np.isfinite(used).all() and mesh.face_areas.sum() > 0)


def placement(source: Mesh, reference: Mesh) -> Iterator[WarningRecord]:
    """Say whether two meshes seem to have other units or to lie in different places."""
    (low, high), (reference_low, reference_high) = _box(source), _box(reference)
    extent, reference_extent = high - low, reference_high - reference_low
    ratio = float(extent.max() / reference_extent.max())
    if not 1 / _OTHER_UNITS <= ratio <= _OTHER_UNITS:
        yield warning(
            unit_factor(ratio) or Code.UNITS_OTHER,
            "pair",
            f"The source is {size_in_words(ratio)} the size of the reference: they may be in "
            "different units, which aligning by similarity can mend.",
        )
        return
    shared = np.minimum(high, reference_high) - np.maximum(low, reference_low)
    smaller = np.minimum(extent, reference_extent)
    shares = (shared + _FLAT) / (smaller + _FLAT)  # a flat mesh has an axis without extent
    axis = int(np.argmin(shares))
    if shares[axis] < _LEAST_OVERLAP:
        yield warning(
            Code.POSE_APART,
            "pair",
            f"Along {'xyz'[axis]} the bounding boxes of source and reference overlap "
            f"by {_percent(max(float(shares[axis]), 0))} only: the meshes may need to be aligned "
            "first.",
        )


def _fit(
    source: Mesh, source_tree: SurfaceTree, reference: Mesh, reference_tree: SurfaceTree
) -> Told:
    used = _used(source)
    chosen = used[:: -(-len(used) // _SAMPLES)]
    closest = reference_tree.closest(source.vertices[chosen])
    samples = sample_surface(reference, _SAMPLES, _SEED)
    missed = source_tree.closest(samples.points).distances > _FAR
    far = closest.distances > _FAR
    told = []
    if far.mean() > _WORTH_TELLING:
        words = (
            f"{_percent(far.mean())} of the source's vertices are farther from the reference than "
            "a tenth of its radius: where the reference has a hole or lacks a part, they have "
            "nothing to follow."
        )
        told.append(warning(Code.COVERAGE_EXTRA, "source", words))
    if missed.mean() > _WORTH_TELLING:
        words = (
            f"{_percent(missed.mean())} of the reference's surface is farther from the source than "
            "a tenth of its radius: where the source has a hole or lacks a part, refining cannot "
            "fill it, because it adds no surface."
        )
        told.append(warning(Code.COVERAGE_MISSING, "reference", words))
    normals = reference.face_normals[closest.faces]
    opposed = row_dot(source.vertex_normals[chosen], normals)[~far] < 0
    if len(opposed) and opposed.mean() > _INSIDE_OUT:
        words = (
            f"{_percent(opposed.mean())} of the source's normals oppose the reference's: one of "
            "the two is inside out."
        )
        told.append(warning(Code.NORMALS_OPPOSED, "pair", words))
    compared = len(opposed) >= _MOST_COMPARED * len(chosen)
    return Told(told, frozenset() if compared else frozenset({Code.NORMALS_OPPOSED}))


def defects(side: Side, mesh: Mesh, validity: Validity) -> Told:
    """Say what is wrong with one mesh by itself."""
    counted = validity.self_intersections is not None
    not_examined = frozenset() if counted else frozenset({Code.FACES_CROSSING})
    return Told(list(_defects(side, mesh, validity)), not_examined)


def _defects(side: Side, mesh: Mesh, validity: Validity) -> Iterator[WarningRecord]:
    isolated = len(mesh.vertices) - len(_used(mesh))
    found = (
        (
            Code.EDGES_NON_MANIFOLD,
            validity.non_manifold_edges,
            ("edge", "edges", "where more than two faces meet"),
        ),
        (
            Code.EDGES_OPPOSED,
            validity.opposed_edges,
            (
                "edge",
                "edges",
                "across which neighbouring faces turn their outsides in opposite directions",
            ),
        ),
        (
            Code.FACES_DUPLICATE,
            validity.duplicate_faces,
            ("face", "faces", "with the same corners as another"),
        ),
        (
            Code.FACES_CROSSING,
            validity.self_intersections,
            ("pair", "pairs", "of faces that pass through each other"),
        ),
        (Code.FACES_DEGENERATE, validity.degenerate_faces, ("face", "faces", "without area")),
        (Code.VERTICES_ISOLATED, isolated, ("vertex", "vertices", "that no face uses")),
    )
    for code, count, (one, many, words) in found:
        if count:
            yield warning(code, side, f"The {side} has {_count(count, one, many)} {words}.")
    if validity.watertight and not validity.opposed_edges and _is_inside_out(mesh):
        words = (
            f"The {side} is closed and encloses a negative volume: its faces are turned inwards."
        )
        yield warning(Code.SURFACE_INSIDE_OUT, side, words)


def _is_inside_out(mesh: Mesh) -> bool:
    """Whether a closed mesh has a negative volume, by the divergence theorem, beyond rounding."""
    # About its middle, for digits.
    heights = row_dot(mesh.corners.mean(axis=1) - mesh.vertices.mean(axis=0), mesh.face_normals)
    volume, area = float(heights @ mesh.face_areas) / 3, float(mesh.face_areas.sum())
    return bool(volume < -_NO_VOLUME * area**1.5)


def _pieces(pieces: int, reference_pieces: int) -> Iterator[WarningRecord]:
    if reference_pieces and pieces != reference_pieces:  # points are in none
        yield warning(
            Code.PIECES_COUNT,
            "pair",
            f"The source is in {_count(pieces, 'piece', 'pieces')} and the reference in "
            f"{_count(reference_pieces, 'piece', 'pieces')}: a piece without a counterpart "
            "has nothing to follow and stays as it is, where the others cover the reference.",
        )


def _box(mesh: Mesh) -> tuple[Floats, Floats]:
    used = mesh.vertices[_used(mesh)]
    return used.min(axis=0), used.max(axis=0)


def _used(mesh: Mesh) -> Ints:
    """Return the vertices some face uses, ascending."""
    return np.flatnonzero(np.bincount(mesh.faces.ravel(), minlength=len(mesh.vertices)))


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _count(number: int, one: str, many: str) -> str:
    return f"{number:,} {one if number == 1 else many}"
