"""Triangle surfaces: the mesh, its frame, samples of it and closest points on it."""

from meshcone.surface.closest import ClosestPoints, SurfaceTree
from meshcone.surface.frame import Frame
from meshcone.surface.mesh import Mesh
from meshcone.surface.sampling import SurfaceSamples, sample_surface

__all__ = ["ClosestPoints", "Frame", "Mesh", "SurfaceSamples", "SurfaceTree", "sample_surface"]
