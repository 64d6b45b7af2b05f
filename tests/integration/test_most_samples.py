"""The most samples that a report may have fit into little memory."""

from __future__ import annotations

import subprocess
import sys

MEMORY = 512 * 2**20  # bytes beyond what a first measurement holds; all distances at once take 5 GB

_MEASURED = f"""
from meshcone.files import MeshFile
from meshcone.options import Options, parse_options
from meshcone.verbs.measure import measure
from tests import shapes
from worker.run.sandbox import limit_resources

def pair(level):
    vertices, faces = shapes.sphere(level)
    meshes = shapes.noisy(vertices), vertices
    return [MeshFile("ball.obj", shapes.obj(each, faces)) for each in meshes]

def sampled(choose):
    kinds = Options.model_json_schema()["$defs"]["QualityOptions"]["properties"]
    named = ("samples", "curvature_samples", "emd_samples")
    return parse_options({{"quality": {{name: choose(kinds[name], name) for name in named}}}})

measure(*pair(1), sampled(lambda kind, _: kind["minimum"]))
limit_resources(seconds=600, memory={MEMORY}, file_bytes=None)
# An exact matching takes memory by the square of its samples, as its own range allows for.
least = "emd_samples"
most = sampled(lambda kind, name: kind["minimum" if name == least else "maximum"])
print(measure(*pair(4), most).outcome)
"""


def test_the_most_samples_take_little_memory() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", _MEASURED], capture_output=True, text=True, timeout=240, check=False
    )

    assert (ended.returncode, ended.stderr) == (0, "")
