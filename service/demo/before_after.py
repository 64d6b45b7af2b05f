"""The picture of input, refined mesh and reference, with the deviation of the first two."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets import read_asset
from service.demo.figures import AFTER_COLOUR, BEFORE_COLOUR, FAINT, INK, new_figure, png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from meshcone.surface import Mesh

_PIXELS = 430  # width and height of each of the five images
_AZIMUTH, _ELEVATION = 58.0, 24.0
_COLOUR_MAP = "RdYlBu_r"
_MILLIMETRES = 1000.0  # in a model unit: glTF's is the metre
_SCALE = (0.001, 10.0)  # millimetres; the ends of the logarithmic colour scale


@dataclass(frozen=True)
class Triple:
    """The three files a picture shows.

    Attributes:
        source, refined, reference: GLB files; the first two have the same triangles.
        face_colours: (m, 3) linear RGB of the triangles, the same in all three.
    """

    source: bytes
    refined: bytes
    reference: bytes
    face_colours: NDArray[np.float64]


def draw_before_after(triple: Triple, report: dict[str, Any]) -> bytes:
    """Draw the picture.

    Args:
        triple: the files.
        report: of the refinement; its mean distances stand under the images.

    Returns:
        A PNG file.
    """
    from meshcone.surface import Frame, SurfaceTree
    from service.demo.render import Camera, View

    source, refined, reference = (
        _mesh(data) for data in (triple.source, triple.refined, triple.reference)
    )
    frame = Frame.of(reference)
    camera = Camera(frame.centre, frame.radius, _AZIMUTH, _ELEVATION, _PIXELS)
    views = [View(mesh, camera) for mesh in (source, refined, reference)]
    tree = SurfaceTree(reference)
    deviations = [
        _MILLIMETRES * tree.closest(mesh.vertices).distances for mesh in (source, refined)
    ]

    figure = new_figure(11.6, 8.4)
    grid = figure.add_gridspec(
        2, 3, left=0.01, right=0.985, top=0.945, bottom=0.04, wspace=0.02, hspace=0.1
    )
    captions = _captions(report)
    for column, (title, view) in enumerate(
        zip(("Input", "Refined", "Reference"), views, strict=True)
    ):
        axes = figure.add_subplot(grid[0, column])
        _show(axes, view.shaded(triple.face_colours), captions[column])
        axes.set_title(title, fontsize=15, color=INK, fontweight="bold", pad=2)
    for column, (view, deviation) in enumerate(zip(views, deviations, strict=False)):
        colours = _mapped(deviation)
        caption = f"colour: distance of each vertex, {deviation.max():.2g} mm at most"
        _show(figure.add_subplot(grid[1, column]), view.coloured(colours), caption)
    _draw_distribution(figure, deviations)
    return png(figure)


def _mesh(data: bytes) -> Mesh:
    from meshcone.surface import Mesh

    asset = read_asset("mesh.glb", data)
    return Mesh(asset.vertices, asset.faces)


def _captions(report: dict[str, Any]) -> list[str]:
    radius = _MILLIMETRES * report["frame"]["radius"]
    quality = report["quality"]
    before, after = (quality[name]["point_to_surface"]["mean"] for name in ("input", "refined"))
    return [
        f"mean distance {before * radius:.3g} mm, {100 * before:.2g} % of the radius",
        f"mean distance {after * radius:.2g} mm, {100 * after:.2g} % of the radius",
        f"radius {radius:.4g} mm",
    ]


def _show(axes: Axes, image: NDArray[np.float64], caption: str) -> None:
    axes.imshow(image, interpolation="antialiased")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_frame_on(False)
    axes.set_xlabel(caption, fontsize=10.5, color=INK, labelpad=3)


def _mapped(distances: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3) colours of (k,) distances in millimetres, on a logarithmic scale."""
    from matplotlib import colormaps

    low, high = np.log(_SCALE)
    shares = (np.log(distances.clip(*_SCALE)) - low) / (high - low)
    return np.asarray(colormaps[_COLOUR_MAP](shares))[:, :3]


def _draw_distribution(figure: Figure, deviations: list[NDArray[np.float64]]) -> None:
    """Histograms of both deviations over the colours of the images beside them."""
    axes = figure.add_axes((0.71, 0.20, 0.265, 0.235))
    bins = np.geomspace(*_SCALE, 60)
    for name, deviation, colour in zip(
        ("input", "refined"), deviations, (BEFORE_COLOUR, AFTER_COLOUR), strict=True
    ):
        axes.hist(deviation.clip(*_SCALE), bins.tolist(), color=colour, alpha=0.85, label=name)
    axes.set_xscale("log")
    axes.set_xlim(*_SCALE)
    axes.set_xticks([])
    axes.set_xticks([], minor=True)
    axes.set_ylabel("vertices", fontsize=10, color=INK)
    axes.tick_params(labelsize=9, colors=INK)
    axes.spines[["top", "right", "bottom"]].set_visible(False)
    axes.spines[["left"]].set_color(FAINT)
    axes.legend(frameon=False, fontsize=10, labelcolor=INK, loc="upper left")

    bar = figure.add_axes((0.71, 0.165, 0.265, 0.03))
    steps = np.geomspace(*_SCALE, 257)
    bar.pcolormesh(steps, [0, 1], _mapped(steps[:-1])[None])
    bar.set_xscale("log")
    bar.set_xlim(*_SCALE)
    bar.set_yticks([])
    bar.tick_params(labelsize=9, colors=INK)
    bar.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    bar.set_xlabel("distance to the reference, mm", fontsize=10, color=INK)
    for spine in bar.spines.values():
        spine.set_visible(False)
