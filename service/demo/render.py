"""Shaded images of a surface, seen from afar."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.surface.arrays import normalized
from meshcone.surface.mesh import Mesh
from meshcone.views.raster import Fragments, rasterize

Floats = NDArray[np.float64]

_OVERSAMPLING = 2  # rendered this much larger, then averaged, which smooths the outline
_MARGIN = 0.9  # share of the image's half width that the fitted radius takes
_GROUND_SHADE, _GROUND_BLUR = 0.28, 0.018  # opacity, and share of the image's width

# Directions towards the lights in the camera's axes (right, up, towards it), and their strength.
_KEY_LIGHT, _KEY = normalized(np.array([-0.55, 0.75, 0.75])), 1.25
_FILL_LIGHT, _FILL = normalized(np.array([0.9, 0.1, 0.5])), 0.35
_AMBIENT = 0.32
_GLOSS, _GLOSS_EXPONENT = 0.45, 60.0


@dataclass(frozen=True)
class Camera:
    """An orthographic camera that looks at a point, with y up.

    Attributes:
        target: (3,) the point in the middle of the image.
        radius: what is within this distance of the target is in the image.
        azimuth, elevation: of the camera as seen from the target, in degrees; azimuth 0 is
            on the z axis and 90 on the x axis.
        size: width and height of the image in pixels.
    """

    target: Floats
    radius: float
    azimuth: float
    elevation: float
    size: int

    @property
    def axes(self) -> Floats:
        """(3, 3) right, up and towards the camera, as rows."""
        a, e = np.radians(self.azimuth), np.radians(self.elevation)
        towards = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
        right = np.array([np.cos(a), 0.0, -np.sin(a)])
        return np.stack([right, np.cross(towards, right), towards])

    def project(self, points: Floats) -> Floats:
        """Map (n, 3) points to oversampled pixels and depth."""
        x, y, z = ((points - self.target) @ self.axes.T).T
        middle = self.size * _OVERSAMPLING / 2
        scale = middle * _MARGIN / self.radius
        return np.stack([middle + scale * x, middle - scale * y, scale * z], axis=1)


class View:
    """A mesh as a camera sees it, to be coloured in more than one way."""

    def __init__(self, mesh: Mesh, camera: Camera) -> None:
        self._mesh = mesh
        self._camera = camera
        self._seen = self._rasterize(mesh.vertices)
        normals = self._seen.interpolate(mesh.vertex_normals, mesh.faces)
        self._normals = normalized(normals) @ camera.axes.T

    def shaded(self, face_colours: Floats) -> Floats:
        """Light the surface.

        Args:
            face_colours: (m, 3) linear RGB.

        Returns:
            (size, size, 4) sRGB and opacity, over a soft shadow on the ground.
        """
        key = np.maximum(self._normals @ _KEY_LIGHT, 0)[:, None]
        fill = np.maximum(self._normals @ _FILL_LIGHT, 0)[:, None]
        sky = 0.6 + 0.4 * self._normals[:, 1:2]
        diffuse = _KEY * key + _FILL * fill + _AMBIENT * sky
        halfway = normalized(_KEY_LIGHT + np.array([0.0, 0.0, 1.0]))
        gloss = np.maximum(self._normals @ halfway, 0)[:, None] ** _GLOSS_EXPONENT
        colours = face_colours[self._seen.faces] * diffuse + _GLOSS * gloss
        return self._image(_to_srgb(colours), shadow=True)

    def coloured(self, vertex_colours: Floats) -> Floats:
        """Paint the surface with (n, 3) sRGB colours, shaded just enough to show its form."""
        form = 0.72 + 0.28 * np.maximum(self._normals @ _KEY_LIGHT, 0)[:, None]
        colours = self._seen.interpolate(vertex_colours, self._mesh.faces)
        return self._image(colours * form, shadow=False)

    def _rasterize(self, points: Floats) -> Fragments:
        pixels = self._camera.size * _OVERSAMPLING
        return rasterize(self._camera.project(points), self._mesh.faces, pixels)

    def _image(self, colours: Floats, *, shadow: bool) -> Floats:
        side = self._camera.size * _OVERSAMPLING
        image = np.zeros((side * side, 4))
        if shadow:
            image[:, 3] = self._ground_shadow().ravel()
        image[self._seen.pixels, :3] = colours.clip(0, 1)
        image[self._seen.pixels, 3] = 1.0
        image[:, :3] *= image[:, 3:]
        blocks = (self._camera.size, _OVERSAMPLING, self._camera.size, _OVERSAMPLING, 4)
        small = image.reshape(blocks).mean(axis=(1, 3))
        small[..., :3] /= np.maximum(small[..., 3:], 1e-9)
        return np.asarray(small.clip(0, 1))

    def _ground_shadow(self) -> Floats:
        """Opacity of the shadow straight below, blurred."""
        from scipy.ndimage import gaussian_filter

        flat = self._mesh.vertices.copy()
        low, high = flat[:, 1].min(), flat[:, 1].max()
        # What is higher up casts less of a shadow: only the lower part touches the ground.
        near = flat[:, 1] < low + 0.2 * (high - low)
        flat[:, 1] = low
        faces = self._mesh.faces[near[self._mesh.faces].all(axis=1)]
        side = self._camera.size * _OVERSAMPLING
        covered = np.zeros(side * side)
        covered[rasterize(self._camera.project(flat), faces, side).pixels] = _GROUND_SHADE
        blurred = gaussian_filter(covered.reshape(side, side), _GROUND_BLUR * side)
        return np.asarray(blurred)


def _to_srgb(linear: Floats) -> Floats:
    """Encode linear light; highlights are rolled off rather than cut."""
    rolled = 1 - np.exp(-1.1 * linear)
    return np.where(rolled <= 0.0031308, 12.92 * rolled, 1.055 * rolled ** (1 / 2.4) - 0.055)
