"""Six orthographic views of source, refined mesh and reference in their own colours, as a PNG.

Everything is drawn here, in NumPy: what renders without a display needs GL libraries on the
machine or is ten times the size of this program's other wheels.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from meshcone.appearance.paint import Paint, Spots, shown
from meshcone.srgb import to_encoded
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats
from meshcone.views.raster import Fragments, OverdrawError, both_ends
from meshcone.views.scene import Scene

VIEW = 160
"""Width and height of one view, in pixels."""

_FINER = 2  # drawn larger by this, then averaged, which smooths outlines
_MARGIN = 1.06
_FARTHEST = 2.0  # radii; what lies beyond is cut off
_AMBIENT, _TOWARDS = 0.45, 0.55  # light from all sides, and from where the viewer is
_UNKNOWN = 0.6  # linear grey of what has no known colour
_PAPER, _INK = (208, 210, 213), (40, 40, 40)
_LEFT, _TOP = 84, 22  # pixels for the names of rows and columns
# Right, down and towards the viewer, as axes and signs: y is up, as in glTF.
_AXES = (
    ("front", "back", (0, 1, 2), (1, -1, 1)),
    ("right", "left", (2, 1, 0), (-1, -1, 1)),
    ("top", "bottom", (0, 2, 1), (1, 1, 1)),
)


@dataclass(frozen=True)
class _Subject:
    """A surface to be drawn, in the frame, and what its row is called."""

    name: str
    mesh: Mesh
    paint: Paint


def pictures_png(scene: Scene) -> bytes | None:
    """Draw a row of six views for each surface of a scene, all at one scale.

    A face is seen from both sides. What has no known colour is grey. A surface whose triangles
    cover a view too many times is left out.

    Returns:
        None where neither file has colours: the preview shows all that is to be seen then.
    """
    if scene.paints is None or not any(paint.has_colour for paint in scene.paints):
        return None
    source, reference = scene.paints
    subjects = [_Subject("source", scene.input.mesh, source)]
    if scene.refined is not None:
        subjects.append(_Subject("refined", scene.refined.mesh, source))
    return _drawn([*subjects, _Subject("reference", scene.reference.mesh, reference)])


def _drawn(subjects: Sequence[_Subject]) -> bytes:
    reach = min(max(map(_extent, subjects)), _FARTHEST) * _MARGIN
    height, width = _TOP + VIEW * len(subjects), _LEFT + 2 * VIEW * len(_AXES)
    sheet = Image.new("RGB", (width, height), _PAPER)
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(13)
    for column, name in enumerate(_columns()):
        place = (_LEFT + VIEW * (column + 0.5), _TOP / 2)
        draw.text(place, name, fill=_INK, font=font, anchor="mm")
    for row, subject in enumerate(subjects):
        middle = _TOP + VIEW * (row + 0.5)
        draw.text((_LEFT / 2, middle), subject.name, fill=_INK, font=font, anchor="mm")
        for column, view in enumerate(_views(subject, reach)):
            sheet.paste(view, (_LEFT + VIEW * column, _TOP + VIEW * row))
    out = io.BytesIO()
    sheet.save(out, "PNG")
    return out.getvalue()


def _columns() -> Iterator[str]:
    for near, far, *_ in _AXES:
        yield from (near, far)


def _extent(subject: _Subject) -> float:
    return float(np.abs(subject.mesh.vertices[subject.mesh.used_vertices]).max())


@dataclass(frozen=True)
class _Seen:
    """What one view shows, and whether its image is mirrored: it was drawn from behind."""

    fragments: Fragments
    axis: int
    mirrored: bool


def _views(subject: _Subject, reach: float) -> list[Image.Image]:
    try:
        seen = list(_seen(subject.mesh, reach))
    except OverdrawError:
        return []
    spots = [Spots(each.fragments.faces, each.fragments.weights) for each in seen]
    colours = subject.paint.colours(spots)
    return [
        _image(each, _lit(subject, each, found)) for each, found in zip(seen, colours, strict=True)
    ]


def _seen(mesh: Mesh, reach: float) -> Iterator[_Seen]:
    size = VIEW * _FINER
    for _, _, axes, signs in _AXES:
        right, down, depth = (
            mesh.vertices[:, axis] * sign for axis, sign in zip(axes, signs, strict=True)
        )
        scale = size / (2 * reach)
        points = np.stack([size / 2 + scale * right, size / 2 + scale * down, depth], axis=1)
        nearest, farthest = both_ends(points, mesh.faces, size)
        yield _Seen(nearest, axes[2], mirrored=False)
        yield _Seen(farthest, axes[2], mirrored=True)


def _lit(subject: _Subject, seen: _Seen, colours: Floats) -> Floats:
    """Linear RGB (p, 3) under a lamp at the viewer's place."""
    unknown = np.isnan(colours[:, :1]) | (not subject.paint.has_colour)
    flat = np.where(unknown, _UNKNOWN, shown(colours))
    towards = np.abs(subject.mesh.face_normals[seen.fragments.faces, seen.axis])
    return np.asarray(flat * (_AMBIENT + _TOWARDS * towards)[:, None])


def _image(seen: _Seen, light: Floats) -> Image.Image:
    size = VIEW * _FINER
    pixels = np.full((size * size, 3), _PAPER, dtype=np.uint8)
    pixels[seen.fragments.pixels] = np.rint(255 * to_encoded(light))
    square = pixels.reshape(size, size, 3)
    return Image.fromarray(square[:, ::-1] if seen.mirrored else square).reduce(_FINER)
