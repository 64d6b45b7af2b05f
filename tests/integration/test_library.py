"""The library in a program of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests import shapes

# numpy first, as programs do: its threads are set before MeshCone is there.
PROGRAM = """
import numpy
numpy.ones((2000, 2000)) @ numpy.ones((2000, 2000))
import meshcone
refined = meshcone.refine("rough.glb", "ball.obj", effort="fast", surface={"edge_cap": 3})
refined.save("library.glb", report="library.json")
"""


def run(folder: Path, *command: str) -> None:
    environment = {key: value for key, value in os.environ.items() if "_THREADS" not in key}
    done = subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr


def test_its_bytes_are_those_of_the_command_line(tmp_path: Path) -> None:
    vertices, faces = shapes.sphere(4)
    (tmp_path / "rough.glb").write_bytes(shapes.glb(shapes.noisy(vertices), faces))
    (tmp_path / "ball.obj").write_bytes(shapes.obj(vertices, faces))

    run(tmp_path, "-c", PROGRAM)
    arguments = ("rough.glb", "ball.obj", "-o", "cli.glb", "--report", "cli.json")
    options = ("--set", "effort=fast", "--set", "surface.edge_cap=3")
    run(tmp_path, "-m", "service.cli", "refine", *arguments, *options)

    assert (tmp_path / "library.glb").read_bytes() == (tmp_path / "cli.glb").read_bytes()
    certificates = [tmp_path / f"{name}.certificate.npz" for name in ("library", "cli")]
    assert certificates[0].read_bytes() == certificates[1].read_bytes()
