"""Two libraries that draw a mesh in a browser, compared on 200,000 triangles.

three.js comes out of the installed trimesh, as the dashboard uses it; plotly's is that of its
wheel (`pip install plotly`). Both are drawn by SwiftShader, without a graphics card. Prints a
table: bytes sent, seconds until the library is there and until the first picture, milliseconds a
picture while the camera turns, and megabytes of the script's heap.

    python benchmarks/viewers.py [--repeats 3]
"""

from __future__ import annotations

import argparse
import functools
import gzip
import http.server
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median

import numpy as np
from playwright.sync_api import Browser, sync_playwright

# A script beside this one has the name of the package.
sys.path.insert(0, str(Path(__file__).parents[1]))
from service.dashboard.libraries import three_js

_SIDE = 317
_ARGUMENTS = [
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
    "--enable-precise-memory-info",
    "--no-sandbox",
]
_COMMON = """
const get = async (name, kind) => new kind(await (await fetch(name)).arrayBuffer());
const frame = () => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
async function measure(draw) {
  const begun = performance.now();
  const mesh = await Promise.all(
    [get('P', Float32Array), get('F', Uint32Array), get('D', Float32Array)]);
  const turn = await draw(...mesh);
  await turn(0);
  const first = performance.now() - begun, turning = performance.now();
  for (let step = 1; step <= 10; step++) await turn(step / 9);
  return [first, (performance.now() - turning) / 10, performance.memory.usedJSHeapSize / 1e6];
}
"""
_THREE = """
<canvas id="view" width="800" height="600"></canvas><script src="library.js"></script><script>
%s
window.run = () => measure((P, F, D) => {
  const renderer = new THREE.WebGLRenderer({canvas: view});
  const geometry = new THREE.BufferGeometry(), colours = new Float32Array(P.length);
  D.forEach((value, index) => colours.set([.5 + 20 * value, 0, .5], 3 * index));
  geometry.setAttribute('position', new THREE.BufferAttribute(P, 3));
  geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));
  geometry.setIndex(new THREE.BufferAttribute(F, 1));
  const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(40, 4 / 3, .1, 10);
  scene.add(new THREE.HemisphereLight(), new THREE.Mesh(geometry,
    new THREE.MeshPhongMaterial({vertexColors: true, flatShading: true})));
  const gl = renderer.getContext(), pixel = new Uint8Array(4);
  return async angle => {
    camera.position.set(3 * Math.sin(angle), 1, 3 * Math.cos(angle));
    camera.lookAt(0, 0, 0);
    renderer.render(scene, camera);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    await frame();
  };
});
</script>
"""
_PLOTLY = """
<div id="view" style="width: 800px; height: 600px"></div><script src="library.js"></script><script>
%s
window.run = () => measure(async (P, F, D) => {
  const part = (A, k) => A.filter((_, index) => index %% 3 === k);
  await Plotly.newPlot(view, [{type: 'mesh3d', x: part(P, 0), y: part(P, 1), z: part(P, 2),
    i: part(F, 0), j: part(F, 1), k: part(F, 2), intensity: D}]);
  return async angle => {
    const eye = {x: 2 * Math.sin(angle), y: 1, z: 2 * Math.cos(angle)};
    await Plotly.relayout(view, {'scene.camera.eye': eye});
    await frame();
  };
});
</script>
"""


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        """Say nothing of each request."""


def main() -> None:
    """Measure both and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    arguments = parser.parse_args()
    from plotly.offline import get_plotlyjs

    candidates = {
        "three.js (trimesh)": (three_js(), _THREE),
        "plotly": (get_plotlyjs().encode(), _PLOTLY),
    }
    print("| library | gzip kB | load s | first picture s | ms a picture | heap MB |")
    print("|---|---|---|---|---|---|")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=arguments.chromium, args=_ARGUMENTS)
        for name, (library, page) in candidates.items():
            rows = [_measured(browser, library, page % _COMMON) for _ in range(arguments.repeats)]
            load, first, each, heap = (median(column) for column in zip(*rows, strict=True))
            size = len(gzip.compress(library)) / 1e3
            row = f"{size:.0f} | {load:.2f} | {first / 1e3:.2f} | {each:.0f} | {heap:.0f}"
            print(f"| {name} | {row} |")
        browser.close()


def _measured(browser: Browser, library: bytes, html: str) -> tuple[float, ...]:
    with tempfile.TemporaryDirectory() as directory:
        folder = Path(directory)
        (folder / "library.js").write_bytes(library)
        (folder / "index.html").write_text(html)
        for name, array in _mesh().items():
            (folder / name).write_bytes(array.tobytes())
        handler = functools.partial(_Quiet, directory=directory)
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            page = browser.new_page()
            begun = time.monotonic()
            page.goto(f"http://127.0.0.1:{server.server_port}/")
            load = time.monotonic() - begun
            figures = page.evaluate("run()")
            page.close()
            server.shutdown()
    return (load, *figures)


def _mesh() -> dict[str, np.ndarray]:
    """A rough sphere: positions, faces and deviations."""
    u, v = np.meshgrid(
        np.linspace(0, 2 * np.pi, _SIDE), np.linspace(0.01, np.pi - 0.01, _SIDE), indexing="ij"
    )
    radius = 1 + 0.01 * np.random.default_rng(0).normal(size=u.shape)
    around = np.stack([np.cos(u) * np.sin(v), np.cos(v), np.sin(u) * np.sin(v)], axis=-1)
    index = np.arange(_SIDE * _SIDE).reshape(_SIDE, _SIDE)
    corners = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    a, b, c, d = (corner.ravel() for corner in corners)
    faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    return {
        "P": (radius[..., None] * around).reshape(-1, 3).astype("<f4"),
        "F": faces.astype("<u4"),
        "D": (radius.ravel() - 1).astype("<f4"),
    }


if __name__ == "__main__":
    main()
