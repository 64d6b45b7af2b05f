"""Draws what detail does: coarse, refined, detailed and reference, with one texture.

The reference is a vase with a relief that its coarse copy knows nothing of; both have the same
texture coordinates and the same texture. Writes ``docs/images/detail.png``:

    python -m benchmarks.detail_picture docs/images/detail.png
"""

from __future__ import annotations

import argparse
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from meshcone.appearance.paint import Paint, Spots, shown
from meshcone.assets import read_asset
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.srgb import to_encoded
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, normalized
from meshcone.verbs.refine import refine
from meshcone.views.raster import Fragments, rasterize

COARSE, FINE = (16, 22), (240, 360)  # rows and columns
GROWTH = 8
SIZE, FINER = 360, 2  # pixels of an image, and how much larger it is drawn
WIDTH = 250  # what is kept of it
CAPTION = 44
EDGE, SPECK = 0.8, 12.0  # half the width of a line, and twice the area of what gets none, drawn
PAPER, INK = (255, 255, 255), (40, 40, 40)
TOWARDS_LIGHT = normalized(np.array([-0.55, 0.6, 0.75]))
RIGHT = normalized(np.array([0.85, 0.0, -0.5]))  # of the viewer
UP = normalized(np.array([-0.12, 0.96, -0.2]) - np.array([-0.12, 0.96, -0.2]) @ RIGHT * RIGHT)
MATERIAL = b"newmtl glaze\nmap_Kd tiles.png\n"


def vase(rows: int, columns: int, *, relief: bool) -> bytes:
    """A vase as an OBJ: quads around a vertical axis, with a seam in its texture."""
    v, u = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    radius = 0.42 + 0.24 * np.sin(2.7 * np.pi * v**0.9 + 0.3) * (1 - 0.35 * v)
    if relief:
        radius = radius + _relief(u, v)
    angle = 2 * np.pi * (u % 1.0)  # both sides of the seam are equal to the bit
    points = np.stack([radius * np.cos(angle), 2 * v - 1, -radius * np.sin(angle)], axis=-1)
    i, j = (index.ravel() for index in np.mgrid[0:rows, 0:columns])
    first = i * (columns + 1) + j + 1
    quads = np.stack([first, first + 1, first + columns + 2, first + columns + 1], axis=1)
    lines = ["mtllib vase.mtl"]
    lines += [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in points.reshape(-1, 3)]
    lines += [f"vt {2 * a:.7f} {b:.7f}" for a, b in zip(u.ravel(), v.ravel(), strict=True)]
    lines += ["usemtl glaze"]
    lines += ["f " + " ".join(f"{corner}/{corner}" for corner in quad) for quad in quads]
    return "\n".join(lines).encode()


def _relief(u: Floats, v: Floats) -> Floats:
    """Leaves around the belly and a twisted cord at the neck."""
    around = np.abs(((7 * u + 0.5) % 1.0) - 0.5)
    leaf = np.clip(1 - (around / 0.42) ** 2 - ((v - 0.33) / 0.16) ** 2, 0, None)
    vein = np.exp(-((around / 0.03) ** 2)) * (leaf > 0)
    cord = np.exp(-(((v - 0.72) / 0.035) ** 2))
    twist = 0.5 + 0.5 * np.cos(2 * np.pi * (15 * u + 9 * v))
    return np.asarray(0.1 * np.sqrt(leaf) - 0.03 * vein + cord * (0.045 + 0.035 * twist))


def tiles() -> bytes:
    """A texture that shows how it is stretched: tiles in two tones with a line around each."""
    y, x = np.mgrid[0:512, 0:512]
    light = (x // 32 + y // 32) % 2 == 0
    pixels = np.where(light[..., None], (222, 208, 178), (70, 128, 134))
    pixels[(x % 32 < 2) | (y % 32 < 2)] = (44, 62, 72)
    buffer = io.BytesIO()
    Image.fromarray(pixels.astype(np.uint8)).save(buffer, "PNG")
    return buffer.getvalue()


@dataclass(frozen=True)
class Panel:
    """A surface, and what stands under it."""

    file: MeshFile
    title: str
    words: str


def panels() -> list[Panel]:
    """Refine the coarse vase without and with added faces."""
    resources = {"vase.mtl": MATERIAL, "tiles.png": tiles()}
    coarse, fine = (
        MeshFile(f"{name}.obj", vase(*size, relief=relief), resources)
        for name, size, relief in (("coarse", COARSE, False), ("fine", FINE, True))
    )
    found = []
    for options in ({}, {"detail": {"growth": GROWTH}}):
        answer = refine(coarse, fine, parse_options(options))
        found.append((answer, MeshFile(answer.name, answer.data, resources)))
    moved, detailed = found
    before = moved[0].report.quality.input.point_to_surface.mean
    return [
        Panel(coarse, "Coarse", _words(coarse, before)),
        *(
            Panel(file, title, _words(file, _mean(answer)))
            for title, (answer, file) in (("Refined", moved), ("Refined with detail", detailed))
        ),
        Panel(fine, "Reference", f"{_faces(fine):,} faces"),
    ]


def _mean(answer: object) -> float:
    refined = answer.report.quality.refined  # type: ignore[attr-defined]
    return float(refined.point_to_surface.mean)


def _words(file: MeshFile, distance: float) -> str:
    return f"{_faces(file):,} faces, mean distance {100 * distance:.2g} %"


def _faces(file: MeshFile) -> int:
    return len(read_asset(file.name, file.data, file.resources).faces)


def drawn(found: list[Panel]) -> bytes:
    """Each surface twice: textured, and flat with the edges of its faces."""
    sheet = Image.new("RGB", (WIDTH * len(found), 2 * SIZE + CAPTION), PAPER)
    draw = ImageDraw.Draw(sheet)
    for column, panel in enumerate(found):
        asset = read_asset(panel.file.name, panel.file.data, panel.file.resources)
        mesh = Mesh(asset.vertices, asset.faces)
        seen = rasterize(_projected(mesh.vertices), mesh.faces, SIZE * FINER)
        textured = shown(Paint(asset).colours([Spots(seen.faces, seen.weights)])[0])
        smooth = normalized(seen.interpolate(mesh.vertex_normals, mesh.faces))
        flat = mesh.face_normals[seen.faces]
        edged = np.where(_at_edges(mesh, seen)[:, None], 0.05, 0.7)
        for row, light in enumerate((textured * _lit(smooth), edged * _lit(flat))):
            sheet.paste(_image(seen.pixels, light), (WIDTH * column, SIZE * row))
        middle = WIDTH * (column + 0.5)
        for y, words, size in ((10, panel.title, 16), (31, panel.words, 12)):
            font = ImageFont.load_default(size)
            draw.text((middle, 2 * SIZE + y), words, fill=INK, font=font, anchor="mm")
    buffer = io.BytesIO()
    sheet.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def _projected(points: Floats) -> Floats:
    axes = np.stack([RIGHT, UP, np.cross(RIGHT, UP)])
    x, y, z = (points @ axes.T).T * (SIZE * FINER * 0.45)
    middle = SIZE * FINER / 2
    return np.stack([middle + x, middle - y, z], axis=1)


def _lit(normals: Floats) -> Floats:
    return np.asarray(0.4 + 0.8 * np.maximum(normals @ TOWARDS_LIGHT, 0)[:, None])


def _at_edges(mesh: Mesh, seen: Fragments) -> Bools:
    """(p,) whether each pixel is at a side of its triangle, where triangles are no specks."""
    corners = _projected(mesh.vertices)[mesh.faces[seen.faces], :2]
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1), axis=2)
    heights = areas[:, None] / np.maximum(sides, 1e-9)
    beside = (seen.weights * heights).min(axis=1) < EDGE
    return np.asarray(beside & (np.median(areas) > SPECK))


def _image(pixels: Ints, light: Floats) -> Image.Image:
    size = SIZE * FINER
    flat = np.full((size * size, 3), PAPER, dtype=np.uint8)
    flat[pixels] = np.rint(255 * to_encoded(light))
    whole = Image.fromarray(flat.reshape(size, size, 3)).reduce(FINER)
    left = (SIZE - WIDTH) // 2
    return whole.crop((left, 0, left + WIDTH, SIZE))


def main() -> None:
    """Draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("picture", type=Path, help="PNG to write")
    parser.parse_args().picture.write_bytes(drawn(panels()))


if __name__ == "__main__":
    main()
