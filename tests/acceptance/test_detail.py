"""Faces added where the source has too few, as users of commands and service see it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from service.client import Client
from tests import shapes
from tests.commands import meshcone

FILES = ("--source", "coarse.obj", "--reference", "ball.obj", "--refined", "out.obj")


def coarse() -> bytes:
    """A ball of few faces, with texture coordinates."""
    vertices, faces = shapes.sphere(2)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    lines += [f"vt {x / 4 + 0.5:.6f} {y / 4 + 0.5:.6f}" for x, y, _ in vertices]
    lines += ["f " + " ".join(f"{corner}/{corner}" for corner in face) for face in faces + 1]
    return "\n".join(lines).encode()


@pytest.fixture(scope="module")
def detailed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("detail")
    (directory / "coarse.obj").write_bytes(coarse())
    (directory / "ball.obj").write_bytes(shapes.obj(*shapes.sphere(3)))
    written = meshcone(
        directory,
        *("refine", "coarse.obj", "ball.obj", "-o", "out.obj", "--report", "out.json"),
        *("--detail", "2x", "--set", "effort=fast"),
    )
    assert written.returncode == 0, written.stderr
    told = json.loads((directory / "out.json").read_text())["detail"]
    assert f"128 → {told['faces_after']} faces, in {told['levels']} levels" in written.stdout
    return directory


def test_the_command_adds_faces_and_verify_proves_them_round_by_round(detailed: Path) -> None:
    finished = meshcone(detailed, "verify", "out.json", *FILES, "--replay")

    lines = finished.stdout.splitlines()
    assert (finished.returncode, finished.stderr) == (0, "")
    assert all(line.startswith("ok ") for line in lines[:-1])
    assert any("of the 128 of the source" in line for line in lines)
    assert "the refined file is the optimum of its last round" in lines[-1]


def test_verify_names_what_was_changed_of_the_texture(detailed: Path) -> None:
    text = (detailed / "out.obj").read_text()
    last = [line for line in text.splitlines() if line.startswith("vt")][-1]
    u, v = map(float, last.split()[1:])
    (detailed / "other.obj").write_text(text.replace(last, f"vt {u:.8f} {v + 0.001:.8f}"))

    finished = meshcone(detailed, "verify", "out.json", *FILES[:-1], "other.obj")

    failed = [line for line in finished.stdout.splitlines() if line.startswith("FAILED")]
    assert finished.returncode == 1
    assert [line.split()[1] for line in failed] == ["refined", "attributes"]
    assert "TEXCOORD_0 of face" in failed[1]
    assert finished.stdout.splitlines()[-1].endswith(
        "that the refined file is an optimum: not proven"
    )


def test_detail_without_end_is_refused_in_one_line(detailed: Path) -> None:
    finished = meshcone(
        detailed, "refine", "coarse.obj", "ball.obj", "-o", "no.obj", "--detail", "auto"
    )

    assert finished.returncode == 2
    assert "--detail auto needs a tolerance to reach" in finished.stderr
    assert not (detailed / "no.obj").exists()


def test_a_job_adds_faces_and_shows_them(client: Client, ball: MeshFile) -> None:
    options = {"effort": "fast", "detail": {"growth": 2}}
    job = client.wait(client.submit(MeshFile("coarse.obj", coarse()), ball, options).id)

    report = client.report(job.id)
    assert report["detail"]["faces_after"] == len(read_asset("r.obj", client.mesh(job.id)).faces)
    assert report["detail"]["faces_after"] > report["inputs"]["source"]["faces"] == 128
