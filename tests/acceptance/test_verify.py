"""``meshcone verify`` as its user sees it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from meshcone.files import MeshFile
from tests.commands import assert_refused, meshcone


@pytest.fixture(scope="module")
def refinement(
    tmp_path_factory: pytest.TempPathFactory, rough_ball: MeshFile, ball: MeshFile
) -> Path:
    """A pair, its refinement, the report and the certificate."""
    made = tmp_path_factory.mktemp("refinement")
    (made / "rough.obj").write_bytes(rough_ball.data)
    (made / "ball.obj").write_bytes(ball.data)
    arguments = ("refine", "rough.obj", "ball.obj", "-o", "out.obj", "--report", "out.json")
    assert meshcone(made, *arguments, "--set", "effort=fast").returncode == 0
    return made


@pytest.fixture
def refined(refinement: Path, tmp_path: Path) -> Path:
    """A copy of it, which may be changed."""
    shutil.copytree(refinement, tmp_path, dirs_exist_ok=True)
    return tmp_path


FILES = ("--source", "rough.obj", "--reference", "ball.obj", "--refined", "out.obj")


def test_verify_says_of_each_check_that_it_holds(refined: Path) -> None:
    finished = meshcone(refined, "verify", "out.json", *FILES)

    lines = finished.stdout.splitlines()
    assert (finished.returncode, finished.stderr) == (0, "")
    assert all(line.startswith("ok ") for line in lines[:-1])
    assert any("dual residual" in line for line in lines)
    assert lines[-1].startswith("proven every point within ")
    assert lines[-1].endswith("rounds before the last: not replayed")


def test_verify_replays_every_round(refined: Path) -> None:
    finished = meshcone(refined, "verify", "out.json", *FILES, "--replay")

    lines = finished.stdout.splitlines()
    assert (finished.returncode, finished.stderr) == (0, "")
    assert all(line.startswith("ok ") for line in lines[:-1])
    assert "every round was solved again and gives the same bytes" in lines[-1]


def test_verify_finds_a_certificate_elsewhere(refined: Path) -> None:
    (refined / "out.certificate.npz").rename(refined / "proof.npz")

    missing = meshcone(refined, "verify", "out.json", *FILES)
    found = meshcone(refined, "verify", "out.json", *FILES, "--certificate", "proof.npz")

    assert_refused(missing, "out.certificate.npz: cannot be read")
    assert found.returncode == 0


def test_verify_fails_where_a_vertex_is_elsewhere(refined: Path) -> None:
    first, *rest = (refined / "out.obj").read_text().splitlines()
    x, y, z = map(float, first.split()[1:])
    (refined / "out.obj").write_text("\n".join([f"v {x + 2e-3} {y} {z}", *rest]) + "\n")

    finished = meshcone(refined, "verify", "out.json", *FILES)

    failed = [line.split()[1] for line in finished.stdout.splitlines() if "FAILED" in line]
    assert (finished.returncode, finished.stderr) == (1, "")
    assert failed == ["refined", "written", "report"]


@pytest.mark.parametrize("name", ["out.json", "out.certificate.npz", "rough.obj", "ball.obj"])
def test_verify_refuses_what_it_cannot_read(refined: Path, name: str) -> None:
    (refined / name).write_bytes(b"Dear diary,\n")

    assert_refused(meshcone(refined, "verify", "out.json", *FILES), name)
