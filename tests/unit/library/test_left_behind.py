"""A mesh that is written away from the files it names is told to lack them."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import pytest

import meshcone
from meshcone.files import MeshFile
from meshcone.local_files import left_behind, read_local
from service.cli import refine as refine_command
from tests import shapes
from tests.unit.library.meshes import FACES, ROUGH, VERTICES, refined

LIBRARY = b"newmtl a\nmap_Kd wood.png\nmap_Ks elsewhere.png\n"
OBJ = MeshFile("a.obj", b"mtllib looks/a.mtl\nv 0 0 0\n", {"looks/a.mtl": LIBRARY})


def put(folder: Path, name: str, data: bytes) -> Path:
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data)
    return folder / name


def gltf(*uris: str) -> bytes:
    listed = ", ".join(f'{{"uri": "{uri}"}}' for uri in uris)
    return f'{{"buffers": [{{"uri": "data:,"}}], "images": [{listed}]}}'.encode()


def test_buffers_and_images_that_are_not_there_are_listed(tmp_path: Path) -> None:
    source = MeshFile("a.gltf", b"", {"te x.png": b"x", "b.bin": b"b", "c.bin": b"c"})
    data = gltf("te%20x.png", "b.bin", "never-sent.png")
    place = put(tmp_path, "out.gltf", data)

    told = left_behind(source, data, place)

    assert told == (
        f"{place} needs files that came with a.gltf and are not beside it, or are others "
        "there: te x.png, b.bin"
    )


def test_a_file_of_that_name_with_other_bytes_is_listed(tmp_path: Path) -> None:
    source = MeshFile("a.gltf", b"", {"same.png": b"same", "other.png": b"sent"})
    data = gltf("same.png", "other.png")
    place = put(tmp_path, "out.gltf", data)
    put(tmp_path, "same.png", b"same")
    put(tmp_path, "other.png", b"here")

    told = left_behind(source, data, place)

    assert told is not None
    assert told.endswith("there: other.png")


def test_material_libraries_and_their_images_are_listed(tmp_path: Path) -> None:
    source = replace(OBJ, resources={**OBJ.resources, "looks/wood.png": b"w", "pins.txt": b"1"})
    place = put(tmp_path, "out.obj", source.data)

    told = left_behind(source, source.data, place)

    assert told is not None
    assert told.endswith("there: looks/a.mtl, looks/wood.png")


def test_nothing_is_told_beside_the_source(tmp_path: Path) -> None:
    put(tmp_path, "looks/a.mtl", LIBRARY)
    put(tmp_path, "looks/wood.png", b"w")
    source = read_local(put(tmp_path, "a.obj", OBJ.data))

    assert left_behind(source, OBJ.data, put(tmp_path, "out.obj", OBJ.data)) is None


def test_nothing_is_told_of_what_went_into_a_device() -> None:
    assert left_behind(OBJ, OBJ.data, Path("/dev/null")) is None


def test_a_long_list_is_cut_short(tmp_path: Path) -> None:
    names = [f"{number}.png" for number in range(12)]
    source = MeshFile("a.gltf", b"", dict.fromkeys(names, b"x"))
    data = gltf(*names)

    told = left_behind(source, data, put(tmp_path, "out.gltf", data))

    assert told is not None
    assert told.endswith("8.png, 9.png and 2 more")


def test_save_warns(tmp_path: Path) -> None:
    result = refined()
    lacking = replace(
        result,
        source=replace(result.source, resources=OBJ.resources),
        done=replace(result.done, data=OBJ.data + result.data),
    )

    with pytest.warns(UserWarning, match=r"out\.obj needs files .*: looks/a\.mtl$"):
        lacking.save(tmp_path / "out.obj")

    put(tmp_path, "looks/a.mtl", LIBRARY)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        lacking.save(tmp_path / "out.obj")


def test_the_command_tells_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def obj(vertices: shapes.Vertices) -> bytes:
        lines = ["mtllib a.mtl", *(f"v {x} {y} {z}" for x, y, z in vertices)]
        return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES)]).encode()

    put(tmp_path, "a.mtl", b"newmtl a\n")
    rough, ball = put(tmp_path, "rough.obj", obj(ROUGH)), put(tmp_path, "ball.obj", obj(VERTICES))
    out = put(tmp_path, "elsewhere/kept", b"").with_name("out.obj")

    refine_command.command(rough, ball, out=out, quiet=True, assignments=["effort=fast"])

    told = capsys.readouterr().err
    assert f"warning        {out} needs files that came with rough.obj" in told
    assert meshcone.load(out).resources == {}
