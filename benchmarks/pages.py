"""What a page of a job costs in Chromium, drawn by SwiftShader, without a graphics card.

    python benchmarks/pages.py [--repeats 3]

Starts a service, has it measure a textured pair of each size, and opens the pages of the jobs with
an empty cache: seconds until the first paint, until the meshes can be turned, and pictures a second
while they are; beside them the processor seconds of all of Chromium, which a busy machine does not
change as much. A page shows a preview, of at most some 100,000 triangles.
"""

from __future__ import annotations

import argparse
import io
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
from PIL import Image
from playwright.sync_api import Browser, Page, Playwright, sync_playwright

# A script beside this one has the name of the package.
sys.path.insert(0, str(Path(__file__).parents[1]))
from meshcone.assets.gltf.builder import GlbBuilder
from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from worker.settings import WorkerSettings

_ARGUMENTS = ["--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--no-sandbox"]
_QUICK = {
    "mode": "measure",
    "quality": {"samples": 1000, "emd_samples": 16, "curvature_samples": 16},
    "deviation": {"prove": False},
}
_FRAMES = 30
_TURN = """async frames => {
  const canvas = document.querySelector('.view canvas');
  const frame = () => new Promise(done => requestAnimationFrame(done));
  await frame();
  const begun = performance.now();
  for (let turn = 0; turn < frames; turn += 1) {
    canvas.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight'}));
    await frame();
  }
  await frame();
  return 1000 * frames / (performance.now() - begun);
}"""
_PAINTED = "() => performance.getEntriesByName('first-contentful-paint')[0].startTime / 1000"


def bumpy_torus(around: int, across: int, bumps: float) -> bytes:
    """A GLB of 2·around·across triangles with a texture of 2048² texels."""
    u, v = np.meshgrid(np.linspace(0, 1, around + 1), np.linspace(0, 1, across + 1), indexing="ij")
    a, b = 2 * np.pi * (u % 1), 2 * np.pi * (v % 1)
    tube = 0.35 + bumps * np.sin(9 * a) * np.sin(7 * b)
    ring = 1 + tube * np.cos(b)
    points = np.stack([ring * np.cos(a), tube * np.sin(b), ring * np.sin(a)], axis=-1)
    row = np.arange((around + 1) * (across + 1)).reshape(around + 1, across + 1)
    one, two, three, four = row[:-1, :-1], row[1:, :-1], row[1:, 1:], row[:-1, 1:]
    faces = np.concatenate([np.stack([one, four, three], -1), np.stack([one, three, two], -1)])
    coarse = np.random.default_rng(2).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    image = io.BytesIO()
    Image.fromarray(coarse).resize((2048, 2048), Image.Resampling.BICUBIC).save(image, "JPEG")
    builder = GlbBuilder()
    attributes = {
        "POSITION": builder.add_vectors(points.reshape(-1, 3), bounds=True),
        "TEXCOORD_0": builder.add_vectors(np.stack([u, v], axis=-1).reshape(-1, 2)),
    }
    primitive = {
        "attributes": attributes,
        "indices": builder.add_indices(faces.reshape(-1, 3)),
        "material": 0,
    }
    picture = {"bufferView": builder.add_file(image.getvalue()), "mimeType": "image/jpeg"}
    return builder.finish(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [primitive]}],
            "images": [picture],
            "textures": [{"source": 0}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        }
    )


@dataclass(frozen=True)
class Visit:
    """What one visit of a page took; times in seconds."""

    painted: float
    ready: float
    ready_processor: float
    pictures: float
    picture_processor: float


def visit(browser: Browser, url: str, layout: str, ticks: Chromium) -> Visit:
    """Open a page in an empty cache, wait for its meshes, and turn them."""
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    before = ticks.seconds()
    page.goto(f"{url}#view={layout}&colour=skin", wait_until="commit")
    page.wait_for_selector("[data-ready]", timeout=120_000)
    ready = page.evaluate("() => performance.now() / 1000")
    loaded = ticks.seconds()
    painted = page.evaluate(_PAINTED)
    pictures = _turned(page)
    turned = ticks.seconds()
    context.close()
    return Visit(painted, ready, loaded - before, pictures, (turned - loaded) / _FRAMES)


def _turned(page: Page) -> float:
    return float(page.evaluate(_TURN, _FRAMES))


class Chromium:
    """The processor seconds of a process and all that it has started."""

    def __init__(self, executable: str) -> None:
        self._name = Path(executable).name

    def seconds(self) -> float:
        """Of all processes below this one whose program is the browser's."""
        total = 0
        for process in self._below(os.getpid()):
            fields = process.rpartition(")")[2].split()
            total += int(fields[11]) + int(fields[12])
        return total / os.sysconf("SC_CLK_TCK")

    def _below(self, parent: int) -> Iterator[str]:
        children: dict[int, list[tuple[int, str]]] = {}
        for path in Path("/proc").glob("[0-9]*/stat"):
            try:
                line = path.read_text()
            except OSError:
                continue  # it has ended meanwhile
            above = int(line.rpartition(")")[2].split()[1])
            children.setdefault(above, []).append((int(path.parent.name), line))
        waiting = [parent]
        while waiting:
            for number, line in children.get(waiting.pop(), []):
                waiting.append(number)
                if self._name[:15] in line:
                    yield line


@contextmanager
def service() -> Iterator[tuple[str, Client]]:
    """A service of its own, in a directory that goes with it."""
    with (
        tempfile.TemporaryDirectory() as directory,
        Stack(WorkerSettings(data_dir=Path(directory)), log=Path(directory) / "log") as stack,
        Client(stack.url) as client,
    ):
        yield stack.url, client


def visits_of(url: str, repeats: int, playwright: Playwright) -> Iterator[str]:
    """Rows of the table for the page of a job, alone and side by side."""
    executable = shutil.which("chromium") or sys.exit("there is no chromium; `make browser`")
    browser = playwright.chromium.launch(executable_path=executable, args=_ARGUMENTS)
    for layout in ("one:input", "side"):
        ticks = Chromium(executable)
        seen = [visit(browser, url, layout, ticks) for _ in range(repeats)]
        painted, ready, processor, pictures, each = (
            median(getattr(one, name) for one in seen) for name in Visit.__dataclass_fields__
        )
        shown = "one" if layout != "side" else "two"
        loading = f"{painted:.2f} | {ready:.2f} | {processor:.2f}"
        yield f"{shown} | {loading} | {pictures:.1f} | {1000 * each:.0f}"
    browser.close()


def main() -> None:
    """Print a row for each size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3)
    repeats = parser.parse_args().repeats
    heads = ("triangles", "meshes", "first paint s", "turned after s", "processor s")
    print(f"| {' | '.join(heads)} | pictures a second | processor ms a picture |")
    print("|---|---|---|---|---|---|---|")
    with service() as (url, client), sync_playwright() as playwright:
        for around, across in ((250, 100), (500, 200)):
            rough, smooth = (
                MeshFile(f"{name}.glb", bumpy_torus(around, across, bumps))
                for name, bumps in (("rough", 0.03), ("smooth", 0.02))
            )
            job = client.wait(client.submit(rough, smooth, _QUICK).id, timeout=600)
            for row in visits_of(f"{url}/jobs/{job.id}", repeats, playwright):
                print(f"| {2 * around * across:,} | {row} |", flush=True)


if __name__ == "__main__":
    main()
