"""Triangle surfaces: the mesh, its frame, samples of it and closest points on it."""

from meshcone.surface.closest import ClosestPoints, SurfaceTree
from meshcone.surface.copies import without_copies
from meshcone.surface.frame import Frame
from meshcone.surface.mesh import Mesh
from meshcone.surface.sampling import SurfaceSamples, sample_surface
from meshcone.surface.subdivision import DividedFaces, Subdivision

__all__ = [
    "ClosestPoints",
    "DividedFaces",
    "Frame",
    "Mesh",
    "Subdivision",
    "SurfaceSamples",
    "SurfaceTree",
    "sample_surface",
    "without_copies",
]
