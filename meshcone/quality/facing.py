"""Whether a mesh is inside out against its reference."""

from __future__ import annotations

from meshcone.surface import Mesh
from meshcone.surface.arrays import row_dot

# Where closest points agree or disagree by less on average, they tell nothing: noise, or a mesh
# that lies across its reference.
_TELLING = 0.1
# Volume over area to the power 3/2, a ninety-fourth of a ball's: of less it may be the rounding
# of a sheet, or what an open mesh happens to enclose.
_ENCLOSING = 1e-3


def orientation_of(mesh: Mesh, reference: Mesh, agreement: float) -> float:
    """Return 1, or −1 where a mesh faces the other way as a whole.

    Args:
        mesh: the judged mesh.
        reference: what it should have been.
        agreement: the mean cosine of its normals with those of the closest faces. Where that is
            too near zero to tell, the signs of the volumes do, should both enclose something.
    """
    if abs(agreement) < _TELLING:
        ours, theirs = _enclosed(mesh), _enclosed(reference)
        if min(abs(ours), abs(theirs)) > _ENCLOSING:
            return 1.0 if ours * theirs > 0 else -1.0
    return 1.0 if agreement >= 0 else -1.0


def _enclosed(mesh: Mesh) -> float:
    """Return the signed volume over the area to the power 3/2; 0 of a mesh without area."""
    area = float(mesh.face_areas.sum())
    if not area:
        return 0.0
    centre = mesh.vertices[mesh.used_vertices].mean(axis=0)
    arms = mesh.corners[:, 0] - centre
    return float(row_dot(arms, mesh.doubled_area_vectors).sum() / 6 / area**1.5)
