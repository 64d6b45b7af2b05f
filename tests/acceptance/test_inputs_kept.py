"""No command writes over a file that it reads, whatever the file is called there."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests import shapes
from tests.acceptance.two_exports import write_exports
from tests.commands import meshcone

NAMES = ("rough.gltf", "rough.bin", "ball.gltf", "ball.bin")


@pytest.fixture
def directory(tmp_path: Path) -> Path:
    """A pair whose buffers are apart, links to both meshes, and gates."""
    vertices, faces = shapes.sphere(1)
    for name, positions in (("rough", shapes.noisy(vertices)), ("ball", vertices)):
        document, buffer = shapes.gltf(positions, faces, f"{name}.bin")
        (tmp_path / f"{name}.gltf").write_bytes(document)
        (tmp_path / f"{name}.bin").write_bytes(buffer)
    (tmp_path / "link.gltf").symlink_to("ball.gltf")
    os.link(tmp_path / "ball.gltf", tmp_path / "hard.gltf")
    (tmp_path / "gates.toml").write_text('[gates]\n"point_to_surface.max" = { max = 0.1 }\n')
    (tmp_path / "pairs.csv").write_text("source,reference\nrough.gltf,ball.gltf\n")
    return tmp_path


def contents(directory: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in directory.iterdir() if path.is_file()}


def assert_kept(directory: Path, place: str, *arguments: str) -> None:
    """It is refused in one line that names the place, and every file is as it was."""
    before = contents(directory)

    done = meshcone(directory, *arguments)

    assert done.returncode == 2, done.stdout
    assert done.stderr == (
        f"meshcone: {place}: it is an input and would be overwritten: "
        "choose another name for what is written\n"
    )
    assert contents(directory) == before


@pytest.mark.parametrize(
    "place",
    ["ball.gltf", "rough.gltf", "./ball.gltf", "../{here}/ball.gltf", "link.gltf", "hard.gltf"],
)
def test_refine_keeps_source_and_reference(directory: Path, place: str) -> None:
    place = place.format(here=directory.name)

    assert_kept(directory, str(Path(place)), "refine", "rough.gltf", "ball.gltf", "-o", place)


@pytest.mark.parametrize("option", ["--report", "--html"])
@pytest.mark.parametrize("place", NAMES)
def test_refine_keeps_what_the_meshes_name(directory: Path, option: str, place: str) -> None:
    assert_kept(
        directory, place, "refine", "rough.gltf", "ball.gltf", "-o", "out.gltf", option, place
    )


def test_refine_keeps_an_input_in_the_place_of_the_certificate(directory: Path) -> None:
    (directory / "ball.certificate.npz").symlink_to("ball.gltf")

    assert_kept(
        directory,
        "ball.certificate.npz",
        *("refine", "rough.gltf", "ball.gltf", "-o", "out.gltf", "--report", "ball.json"),
    )


@pytest.mark.parametrize("place", NAMES)
def test_submit_keeps_its_inputs_and_asks_no_service(directory: Path, place: str) -> None:
    nobody = ("--server", "http://127.0.0.1:9")

    assert_kept(directory, place, "submit", "rough.gltf", "ball.gltf", *nobody, "--report", place)


@pytest.mark.parametrize("option", ["--json", "--junit", "--sarif", "--html"])
@pytest.mark.parametrize("place", [*NAMES, "gates.toml", "pairs.csv"])
def test_gate_keeps_meshes_gates_and_manifest(directory: Path, option: str, place: str) -> None:
    assert_kept(
        directory, place, "gate", "--manifest", "pairs.csv", "--gates", "gates.toml", option, place
    )


def test_two_outputs_in_one_place_are_refused(directory: Path) -> None:
    done = meshcone(
        directory,
        *("refine", "rough.gltf", "ball.gltf", "-o", "out.gltf"),
        *("--report", "out.json", "--html", "./out.json"),
    )

    assert done.returncode == 2
    assert "two files are to be written here" in done.stderr
    assert not (directory / "out.gltf").exists()


def test_a_changed_buffer_selects_the_pairs_that_name_it(tmp_path: Path) -> None:
    write_exports(tmp_path)

    done = meshcone(
        tmp_path, "gate", "new/a.bin", "--manifest", "pairs.csv", "--gates", "gates.json"
    )

    assert done.returncode == 1, done.stdout
    assert "worst deviation 0.2 of the radius" in done.stdout
