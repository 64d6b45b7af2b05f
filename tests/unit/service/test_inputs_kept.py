"""No command writes over a file that it reads, or that is somebody else's."""

from __future__ import annotations

from pathlib import Path

import pytest

from meshcone.errors import InputError
from service.cli import demo, gate, submit, thresholds

NOBODY = "http://127.0.0.1:9"
LISTED = "cones.pin.vertices_file=pins.txt"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    """A mesh with a texture and a list of vertices beside it."""
    place = tmp_path / "mug.obj"
    place.write_text(f"mtllib mug.mtl\n{TRIANGLE}")
    (tmp_path / "mug.mtl").write_text("newmtl glaze\nmap_Kd asset-1.png\n")
    (tmp_path / "asset-1.png").write_bytes(b"texture")
    (tmp_path / "pins.txt").write_text("0\n")
    return place


@pytest.mark.parametrize("pictures", [".", "linked"])
def test_a_picture_is_not_drawn_over_a_texture(
    mesh: Path, monkeypatch: pytest.MonkeyPatch, pictures: str
) -> None:
    monkeypatch.chdir(mesh.parent)
    Path("linked").symlink_to(".")

    with pytest.raises(InputError, match=r"asset-1\.png: it is an input and would be overwritten"):
        gate.command([mesh, mesh], profile="web", pictures=Path(pictures))


def test_a_picture_is_not_drawn_over_another_file_of_the_run(mesh: Path) -> None:
    pictures = mesh.parent / "pictures"
    pictures.mkdir()

    with pytest.raises(InputError, match="two files are to be written here"):
        gate.command(
            [mesh, mesh], profile="web", markdown_file=pictures / "asset-1.png", pictures=pictures
        )


def test_a_list_of_vertices_is_not_written_over(mesh: Path) -> None:
    pins = mesh.parent / "pins.txt"
    said = r"pins\.txt: it is an input and would be overwritten"

    with pytest.raises(InputError, match=said):
        gate.command([mesh, mesh], profile="web", refine=True, assignments=[LISTED], json_file=pins)
    with pytest.raises(InputError, match=said):
        submit.command(str(mesh), str(mesh), server=NOBODY, assignments=[LISTED], report=pins)
    with pytest.raises(InputError, match=said):
        thresholds.command([mesh, mesh], assignments=[LISTED], out=pins)


def test_a_demo_writes_over_nothing_that_no_demo_has_written(tmp_path: Path) -> None:
    for name in ("report.json", "reference.glb"):
        (tmp_path / name).write_bytes(b"somebody's")

    with pytest.raises(InputError, match=r"did not write: reference\.glb, report\.json; give"):
        demo.command(tmp_path)

    assert {each.read_bytes() for each in tmp_path.iterdir()} == {b"somebody's"}


def test_a_demo_may_be_repeated_where_one_was_run(tmp_path: Path) -> None:
    from service.demo.asset import reference_glb

    jug = reference_glb()
    (tmp_path / "reference.glb").write_bytes(jug)
    (tmp_path / "report.json").write_text("{}")

    demo.require_own(tmp_path, jug)


def test_the_log_of_a_demo_that_failed_replaces_no_file(tmp_path: Path) -> None:
    for name in ("service.log", "service-2.log"):
        (tmp_path / name).touch()

    assert demo.free_place(tmp_path / "service.log") == tmp_path / "service-3.log"
