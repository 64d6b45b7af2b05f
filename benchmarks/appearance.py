"""What the colour difference makes of changes that do harm and of some that do none.

    python benchmarks/appearance.py [--assets FILE ...]

A row for each change, a column for each asset: the 95th percentile of CIEDE2000, which gates are
meant to bound, at 5,000 samples of either surface. The assets are made here: a globe with a
photograph's kind of skin, a ring with a label on it, a stack of blocks in four materials, and a
ball with colours at its vertices; or files that trimesh can read. What a smaller or compressed
texture does depends on its detail: there the table is to be read, not summed up. Where
scikit-image is installed, its CIEDE2000 is compared with ours.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from rich.console import Console
from rich.table import Table
from trimesh.visual import ColorVisuals, TextureVisuals
from trimesh.visual.material import PBRMaterial

from meshcone.appearance.ciede2000 import differences, to_lab
from meshcone.appearance.records import ColorDifference
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.srgb import to_encoded, to_linear
from meshcone.verbs.measure import measure

_OPTIONS = parse_options({"quality": {"emd_samples": 16, "curvature_samples": 16}})
_SIZE = 1024  # of a texture

Parts = list[trimesh.Trimesh]
Harm = Literal["none", "depends", "always"]
Pixels = NDArray[np.uint8]
Shape = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Change:
    """A change to an asset; None where it has nothing to change."""

    name: str
    harm: Harm
    apply: Callable[[Parts], Parts | None]


def main() -> None:
    """Measure every asset under every change and print the table."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--assets", type=Path, nargs="*", default=[])
    files = arguments.parse_args().assets
    assets = {path.stem: loaded(path) for path in files} or dict(made_assets())
    table = Table(title="appearance.color_difference.p95")
    for column in ("change", "harm", *assets):
        table.add_column(column, justify="left" if column == "change" else "right")
    found: dict[Harm, list[float]] = {"none": [], "depends": [], "always": []}
    seconds = []
    for change in changes():
        cells = []
        for parts in assets.values():
            changed = change.apply([part.copy() for part in parts])
            cells.append(
                "" if changed is None else compared(changed, parts, found[change.harm], seconds)
            )
        table.add_row(change.name, change.harm, *cells)
    Console(width=120).print(table)
    print(f"no harm: {max(found['none']):.1f} at most; harm: {min(found['always']):.1f} at least")
    print(f"{np.median(seconds):.2f} s (median), {max(seconds):.2f} s (most)")
    print(scikit_image())


def compared(source: Parts, reference: Parts, values: list[float], seconds: list[float]) -> str:
    """The difference, added to the others, as are the seconds it took."""
    files = [MeshFile("a.glb", written(parts)) for parts in (source, reference)]
    report = measure(*files, _OPTIONS)
    assert report.appearance is not None
    found = report.appearance.color_difference
    assert isinstance(found, ColorDifference), report.appearance.why_not_tested
    values.append(found.p95)
    seconds.append(report.timings.metrics["appearance"])
    return f"{found.p95:.1f}"


def written(parts: Parts) -> bytes:
    """The parts as a GLB file."""
    scene = trimesh.Scene({str(number): part for number, part in enumerate(parts)})
    return bytes(scene.export(file_type="glb"))


def loaded(path: Path) -> Parts:
    """The parts of a file, where its scene has them."""
    scene = trimesh.load(path, force="scene")
    parts = []
    for node in sorted(scene.graph.nodes_geometry):
        matrix, name = scene.graph[node]
        part = scene.geometry[name].copy()
        if isinstance(part, trimesh.Trimesh):
            part.apply_transform(matrix)
            if isinstance(part.visual, TextureVisuals) and not isinstance(
                part.visual.material, PBRMaterial
            ):
                part.visual.material = part.visual.material.to_pbr()
            parts.append(part)
    return parts


def made_assets() -> Iterator[tuple[str, Parts]]:
    """The assets of the benchmark's own."""
    yield "globe", [grid(globe, photograph())]
    yield "label", [grid(ring, label())]
    yield "blocks", list(blocks())
    yield "scan", [scan()]


def grid(shape: Shape, image: Pixels, across: int = 96, along: int = 48) -> trimesh.Trimesh:
    """A surface over the unit square, which the image fills."""
    u, v = np.meshgrid(np.linspace(0, 1, across + 1), np.linspace(0, 1, along + 1))
    number = np.arange(u.size).reshape(u.shape)
    a, b = number[:-1, :-1].ravel(), number[:-1, 1:].ravel()
    c, d = number[1:, :-1].ravel(), number[1:, 1:].ravel()
    faces = np.concatenate([np.stack([a, d, c], axis=1), np.stack([a, b, d], axis=1)])
    material = PBRMaterial(
        baseColorTexture=Image.fromarray(image), baseColorFactor=[255] * 4, metallicFactor=0.0
    )
    made = trimesh.Trimesh(
        shape(u.ravel(), v.ravel()),
        faces,
        visual=TextureVisuals(uv=np.stack([u.ravel(), v.ravel()], axis=1), material=material),
        process=False,
    )
    made.metadata["coarser"] = lambda: grid(shape, image, across * 7 // 10, along * 7 // 10)
    return made


def globe(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """A sphere."""
    around, down = 2 * np.pi * u, np.pi * (v - 0.5)
    return np.stack(
        [np.cos(down) * np.cos(around), np.cos(down) * np.sin(around), np.sin(down)], axis=1
    )


def ring(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """A torus."""
    around, over = 2 * np.pi * u, 2 * np.pi * v
    wide = 1 + 0.4 * np.cos(over)
    return np.stack([wide * np.cos(around), wide * np.sin(around), 0.4 * np.sin(over)], axis=1)


def photograph() -> Pixels:
    """Patches of colour with finer ones on them, fainter by a fifth from octave to octave."""
    rng = np.random.default_rng(6)
    summed = np.zeros((_SIZE, _SIZE, 3))
    for octave in range(2, 9):
        grey = rng.normal(size=(2**octave, 2**octave, 1))
        coarse = (grey + 0.5 * rng.normal(size=(2**octave, 2**octave, 3))).astype(np.float32)
        for channel in range(3):
            patch = Image.fromarray(coarse[..., channel])
            fine = patch.resize((_SIZE, _SIZE), Image.Resampling.BICUBIC)
            summed[..., channel] += 0.8**octave * np.asarray(fine)
    low, high = np.percentile(summed, (1, 99))
    return (255 * ((summed - low) / (high - low)).clip(0, 1)).astype(np.uint8)


def label() -> Pixels:
    """Bars, discs and lines with sharp edges, as printed things have."""
    y, x = np.mgrid[0:_SIZE, 0:_SIZE] / _SIZE
    image = np.full((_SIZE, _SIZE, 3), (235, 225, 200), dtype=np.uint8)
    image[(x % 0.5) < 0.12] = (170, 30, 40)
    image[np.hypot(x - 0.6, y - 0.4) < 0.2] = (30, 60, 140)
    image[(np.abs(x - 0.3) < 0.1) & (y % 0.1 < 0.04) & (y > 0.5)] = (20, 20, 20)
    image[np.abs(y - 0.8) < 0.02] = (240, 190, 30)
    return image


def blocks() -> Iterator[trimesh.Trimesh]:
    """Boxes on top of each other, each in one colour."""
    for number, color in enumerate([(200, 40, 40), (40, 160, 60), (50, 70, 200), (230, 200, 60)]):
        box = trimesh.creation.box(extents=(1 - 0.15 * number, 1 - 0.15 * number, 0.5))
        box = box.subdivide().subdivide()
        box.apply_translation((0, 0, 0.55 * number))
        factor = [*(255 * to_linear(np.array(color) / 255)).round().astype(int), 255]
        box.visual = TextureVisuals(
            uv=box.vertices[:, :2], material=PBRMaterial(baseColorFactor=factor, metallicFactor=0.0)
        )
        yield box


def scan() -> trimesh.Trimesh:
    """A bumpy ball with a colour at each of its vertices."""
    ball = trimesh.creation.icosphere(subdivisions=5)
    waves = np.sin(5 * ball.vertices) + np.sin(9 * ball.vertices[:, [1, 2, 0]])
    colours = (127 + 60 * waves).clip(0, 255).astype(np.uint8)
    ball.vertices *= 1 + 0.03 * waves.mean(axis=1, keepdims=True)
    ball.visual = ColorVisuals(
        ball, vertex_colors=np.column_stack([colours, np.full(len(colours), 255)])
    )
    return ball


def changes() -> Iterator[Change]:
    """The changes, those that do no harm first."""
    yield Change("none", "none", lambda parts: parts)
    yield Change("noise of .1 % of the radius", "none", noisy)
    yield Change("half the triangles", "none", coarser)
    yield Change("factor times .9", "none", on_factors(lambda factor: factor * (0.9, 0.9, 0.9, 1)))
    yield Change("JPEG, quality 90", "depends", on_images(lambda image: jpeg(image, 90)))
    yield Change("texture a quarter", "depends", on_images(lambda image: smaller(image, 4)))
    yield Change("JPEG, quality 20", "depends", on_images(lambda image: jpeg(image, 20)))
    yield Change("texture a sixteenth", "depends", on_images(lambda image: smaller(image, 16)))
    yield Change("sRGB read as linear", "always", on_images(as_linear))
    yield Change("red and blue swapped", "always", on_images(lambda image: image[..., ::-1]))
    yield Change("V flipped", "always", on_images(lambda image: image[::-1]))
    yield Change("replaced by magenta", "always", on_images(magenta))
    yield Change("texture lost", "always", without_texture)
    yield Change("coordinates scrambled", "always", scrambled)
    yield Change("materials rotated", "always", rotated)
    yield Change("vertex colours lost", "always", without_colours)


def textured(part: trimesh.Trimesh) -> bool:
    """Whether a part has a texture."""
    return (
        isinstance(part.visual, TextureVisuals)
        and getattr(part.visual.material, "baseColorTexture", None) is not None
    )


def on_images(change: Callable[[Pixels], Pixels]) -> Callable[[Parts], Parts | None]:
    """Change the textures of all parts."""

    def apply(parts: Parts) -> Parts | None:
        for part in filter(textured, parts):
            image = np.asarray(part.visual.material.baseColorTexture.convert("RGB"))
            made = Image.fromarray(np.ascontiguousarray(change(image)))
            part.visual.material = part.visual.material.copy()
            part.visual.material.baseColorTexture = made
        return parts if any(map(textured, parts)) else None

    return apply


def on_factors(
    change: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> Callable[[Parts], Parts | None]:
    """Change the factors of all materials."""

    def apply(parts: Parts) -> Parts | None:
        found = [part for part in parts if isinstance(part.visual, TextureVisuals)]
        for part in found:
            factor = part.visual.material.baseColorFactor
            whole = np.array([255.0] * 4) if factor is None else np.asarray(factor, dtype=float)
            part.visual.material = part.visual.material.copy()
            part.visual.material.baseColorFactor = change(whole).round().astype(np.uint8)
        return parts if found else None

    return apply


def noisy(parts: Parts) -> Parts:
    """Move each vertex by a thousandth of the radius, those in one place together."""
    points = np.concatenate([part.vertices for part in parts])
    amount = 1e-3 * np.linalg.norm(np.ptp(points, axis=0)) / 2
    _, place = np.unique(points.round(6), axis=0, return_inverse=True)
    offsets = amount * np.random.default_rng(3).normal(size=(place.max() + 1, 3))
    moved = points + offsets[place.ravel()]
    for part, start in zip(parts, np.cumsum([0, *(len(p.vertices) for p in parts)]), strict=False):
        part.vertices = moved[start : start + len(part.vertices)]
    return parts


def coarser(parts: Parts) -> Parts | None:
    """The parts of our own with half as many triangles."""
    if not all("coarser" in part.metadata for part in parts):
        return None
    return [part.metadata["coarser"]() for part in parts]


def jpeg(image: Pixels, quality: int) -> Pixels:
    """What JPEG leaves of an image."""
    out = io.BytesIO()
    Image.fromarray(image).save(out, "JPEG", quality=quality)
    return np.asarray(Image.open(out))


def smaller(image: Pixels, times: int) -> Pixels:
    """The image with a texel for each block of them."""
    return np.asarray(Image.fromarray(image).reduce(times))


def as_linear(image: Pixels) -> Pixels:
    """The image brightened as by a tool that takes it for linear light."""
    return (255 * to_encoded(image / 255)).round().astype(np.uint8)


def magenta(_: Pixels) -> Pixels:
    """Two texels that nobody overlooks."""
    return np.tile(np.array([255, 0, 255], dtype=np.uint8), (2, 1, 1)).reshape(1, 2, 3)


def without_texture(parts: Parts) -> Parts | None:
    """Leave the factors alone."""
    found = list(filter(textured, parts))
    for part in found:
        part.visual.material = part.visual.material.copy()
        part.visual.material.baseColorTexture = None
    return parts if found else None


def scrambled(parts: Parts) -> Parts | None:
    """Give every vertex the coordinates of another."""
    found = list(filter(textured, parts))
    for part in found:
        order = np.random.default_rng(2).permutation(len(part.visual.uv))
        part.visual.uv = part.visual.uv[order]
    return parts if found else None


def rotated(parts: Parts) -> Parts | None:
    """Give every part the material of the next."""
    if len({id(part.visual) for part in parts}) < 2 or not all(
        isinstance(part.visual, TextureVisuals) for part in parts
    ):
        return None
    materials = [part.visual.material for part in parts]
    for part, material in zip(parts, materials[1:] + materials[:1], strict=True):
        part.visual.material = material
    return parts


def without_colours(parts: Parts) -> Parts | None:
    """Leave the shape alone."""
    if not any(isinstance(part.visual, ColorVisuals) for part in parts):
        return None
    return [trimesh.Trimesh(part.vertices, part.faces, process=False) for part in parts]


def scikit_image() -> str:
    """How far our CIEDE2000 and its are apart on random colours."""
    try:
        from skimage.color import deltaE_ciede2000, rgb2lab
    except ImportError:
        return "scikit-image is not installed: its CIEDE2000 was not compared"
    rng = np.random.default_rng(8)
    first = rng.random((100_000, 3))
    second = (first + rng.normal(0, 0.2, first.shape)).clip(0, 1)
    ours = [to_lab(to_linear(each)) for each in (first, second)]
    formula = np.abs(differences(*ours) - deltaE_ciede2000(*ours)).max()
    whole = np.abs(differences(*ours) - deltaE_ciede2000(rgb2lab(first), rgb2lab(second))).max()
    return f"scikit-image: {formula:.1e} apart at most, {whole:.1e} with its own L*a*b*"


if __name__ == "__main__":
    main()
