"""Bringing a source to its reference before it is refined."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from meshcone.surface.arrays import Floats
from meshcone.surface.frame import Frame
from meshcone.surface.mesh import Mesh
from meshcone.surface.registration import Registration

AlignmentMode = Literal["rigid", "similarity"]
AlignmentMethod = Literal["none", "correspondence", "icp"]

# Noise alone lets a fit gain a little: less than this share is no reason to move a mesh.
_WORTHWHILE = 0.01
# A fit this close, relative to the reference's radius, cannot be told from a perfect one.
_PERFECT = 1e-6
# Vertices that correspond lie within noise of each other after the motion that fits them best.
_CORRESPONDING = 0.02


@dataclass(frozen=True)
class Alignment:
    """How a source was moved onto its reference.

    Distances are root mean squares over samples of either surface to the other, in model units.

    Attributes:
        matrix: (4, 4) similarity from the source to the reference, for column vectors.
        method: ``correspondence`` in closed form, ``icp`` by search, ``none`` if the source
            stays where it is.
        before: distance of the source as it is.
        after: distance of the moved source.
        note: why nothing was moved, if nothing was.
    """

    matrix: Floats
    method: AlignmentMethod
    before: float
    after: float
    note: str | None = None


def align(source: Mesh, reference: Mesh, mode: AlignmentMode, seed: int) -> Alignment:
    """Find the motion that brings ``source`` closest to ``reference``.

    Where meshes with the same faces correspond vertex by vertex, the best motion has a closed
    form (Umeyama 1991). Others are searched for it, and so are those it leaves apart: boxes and
    grids have the same faces whatever way they lie. A mirror image is never the answer.

    Args:
        source: the mesh to move; of positive area.
        reference: the mesh to move it to; of positive area.
        mode: ``rigid`` keeps the source's size, ``similarity`` may change it.
        seed: the same seed gives the same answer.

    Raises:
        InputError: the reference has no extent.
    """
    frame = Frame.of(reference)
    framed_source, framed_reference = _framed(source, frame), _framed(reference, frame)
    registration = Registration(framed_source, framed_reference, seed)
    scaled = mode == "similarity"
    method: AlignmentMethod = "correspondence"
    matrix: Floats | None = None
    if _correspond(source, reference):
        matrix = _closed_form(framed_source, framed_reference, scaled=scaled)
    if matrix is None or registration.matches(matrix).rms() > _CORRESPONDING:
        searched = registration.search(scaled=scaled)
        if matrix is None or _misfit(registration, searched) < _misfit(registration, matrix):
            method, matrix = "icp", searched
    before = registration.matches(np.eye(4)).rms()
    after = registration.matches(matrix).rms()
    if after < (1 - _WORTHWHILE) * before and before - after > _PERFECT:
        into, out_of = _frame_matrices(frame)
        found = out_of @ matrix @ into
        return Alignment(found, method, before * frame.radius, after * frame.radius)
    distance = before * frame.radius
    note = "no motion brings the source closer to the reference, so it stays in place"
    return Alignment(np.eye(4), "none", distance, distance, note)


def distances_under(
    source: Mesh, reference: Mesh, matrix: Floats, seed: int
) -> tuple[float, float]:
    """Measure how far two meshes lie apart before and after a motion, as :func:`align` does.

    Args:
        source: the mesh to move; of positive area.
        reference: the mesh it was moved to; of positive area.
        matrix: (4, 4) similarity from the source to the reference.
        seed: of the samples.

    Returns:
        Root mean squares over samples of either surface to the other, in model units.
    """
    frame = Frame.of(reference)
    registration = Registration(_framed(source, frame), _framed(reference, frame), seed)
    into, out_of = _frame_matrices(frame)
    before, after = (
        registration.matches(motion).rms() for motion in (np.eye(4), into @ matrix @ out_of)
    )
    return before * frame.radius, after * frame.radius


def _misfit(registration: Registration, matrix: Floats) -> float:
    return registration.matches(matrix).misfit()


def _framed(mesh: Mesh, frame: Frame) -> Mesh:
    return mesh.moved_to(frame.into(mesh.vertices))


def _correspond(source: Mesh, reference: Mesh) -> bool:
    return len(source.vertices) == len(reference.vertices) and np.array_equal(
        source.faces, reference.faces
    )


def _closed_form(source: Mesh, reference: Mesh, *, scaled: bool) -> Floats:
    import trimesh  # half a second to import, and only this needs it

    matrix = trimesh.registration.procrustes(
        source.vertices, reference.vertices, reflection=False, scale=scaled, return_cost=False
    )
    return np.asarray(matrix, dtype=np.float64)


def _frame_matrices(frame: Frame) -> tuple[Floats, Floats]:
    into, out_of = np.eye(4), np.eye(4)
    into[:3] = np.column_stack([np.eye(3) / frame.radius, -frame.centre / frame.radius])
    out_of[:3] = np.column_stack([np.eye(3) * frame.radius, frame.centre])
    return into, out_of
