"""What the colour difference makes of changes that do harm and of some that do none.

    python benchmarks/appearance.py [--assets FILE ...]

A row for each change, a column for each asset: the 95th percentile of CIEDE2000, which gates are
meant to bound, at 5,000 samples of either surface. The assets are our own: a globe with a
photograph's kind of skin, a ring with a label on it, a stack of blocks in four materials, and a
ball with colours at its vertices; or files that trimesh can read. What a smaller or compressed
texture does depends on its detail: there the table is to be read, not summed up. Where
scikit-image is installed, its CIEDE2000 is compared with ours.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import trimesh
from appearance_assets import Parts, made_assets
from appearance_changes import Harm, changes
from rich.console import Console
from rich.table import Table
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from meshcone.appearance.ciede2000 import differences, to_lab
from meshcone.appearance.records import ColorDifference
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.srgb import to_linear
from meshcone.verbs.measure import measure

_OPTIONS = parse_options({"quality": {"emd_samples": 16, "curvature_samples": 16}})


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
