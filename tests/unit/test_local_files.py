"""Meshes on this machine, and the files beside them."""

from __future__ import annotations

import json
import os
from pathlib import Path

from meshcone.assets import read_asset
from meshcone.local_files import files_of, read_local


def test_what_is_in_a_pipe_stays_there_for_its_reader(tmp_path: Path) -> None:
    pipe = tmp_path / "sent.gltf"
    os.mkfifo(pipe)
    descriptor = os.open(pipe, os.O_RDWR)
    try:
        os.write(descriptor, b'{"buffers": [{"uri": "sent.bin"}]}')

        assert files_of(pipe) == [pipe]
        assert os.read(descriptor, 1000).startswith(b'{"buffers"')
    finally:
        os.close(descriptor)


def test_the_buffers_of_a_gltf_are_among_its_files(tmp_path: Path) -> None:
    mesh, buffer = tmp_path / "a.gltf", tmp_path / "a.bin"
    mesh.write_text('{"buffers": [{"uri": "a.bin"}, {"uri": "missing.bin"}]}')
    buffer.touch()

    assert files_of(mesh) == [mesh, buffer]


def test_buffers_in_folders_are_found_and_none_outside(tmp_path: Path) -> None:
    mesh = tmp_path / "model" / "a.gltf"
    buffer = tmp_path / "model" / "data" / "a b.bin"
    buffer.parent.mkdir(parents=True)
    buffer.write_bytes(b"abc")
    (tmp_path / "secret.bin").write_bytes(b"secret")
    uris = ["./data/a%20b.bin", "../secret.bin", "data/../../secret.bin"]
    mesh.write_text(json.dumps({"buffers": [{"uri": uri} for uri in uris]}))

    assert read_local(mesh).resources == {"data/a b.bin": b"abc"}


def test_a_library_of_several_may_have_a_no_break_space_in_its_name(tmp_path: Path) -> None:
    mesh = tmp_path / "a.obj"
    mesh.write_text("mtllib a\u00a0b.mtl c.mtl\n")
    for name in ("a\u00a0b.mtl", "c.mtl"):
        (tmp_path / name).touch()

    assert set(read_local(mesh).resources) == {"a\u00a0b.mtl", "c.mtl"}


def obj_with_images(folder: Path) -> Path:
    """An OBJ with a library in a folder, whose images are in several places."""
    mesh = folder / "model" / "a.obj"
    library = folder / "model" / "looks" / "a b.mtl"
    library.parent.mkdir(parents=True)
    library.write_text(
        "newmtl one\nmap_Kd -s 2 2 1 here.png\nmap_Ks ../shared/far.png\n"
        "newmtl two\nmap_Kd C:\\Users\\somebody\\wall.png\nbump missing.png\n"
        "map_d ../../secret.png\n"
    )
    for name in ("looks/here.png", "shared/far.png", "looks/wall.png", "unnamed.png"):
        (mesh.parent / name).parent.mkdir(exist_ok=True)
        (mesh.parent / name).write_bytes(name.encode())
    (folder / "secret.png").write_bytes(b"secret")
    mesh.write_text("# mtllib unnamed.png\n  mtllib looks/a b.mtl # two words\nv 0 0 0\n")
    return mesh


def test_the_libraries_of_an_obj_and_their_images_are_found_and_none_outside(
    tmp_path: Path,
) -> None:
    mesh = obj_with_images(tmp_path)

    file = read_local(mesh)

    assert set(file.resources) == {
        *("looks/a b.mtl", "looks/here.png", "shared/far.png", "looks/wall.png"),
    }
    assert {*files_of(mesh)} == {mesh, *(mesh.parent / name for name in file.resources)}


def test_the_images_that_were_found_are_those_the_reader_looks_for(tmp_path: Path) -> None:
    mesh = obj_with_images(tmp_path)
    file = read_local(mesh)
    data = b"mtllib looks/a b.mtl\nusemtl one\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

    content = read_asset("a.obj", data, file.resources).content()

    assert {image.name: image.data for image in content.images} == {
        "here.png": b"looks/here.png",
        "../shared/far.png": b"shared/far.png",
        "C:\\Users\\somebody\\wall.png": b"looks/wall.png",
        "missing.png": None,
        "../../secret.png": None,
    }


def test_the_images_of_a_gltf_and_of_a_glb_are_found(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "a b.png").write_bytes(b"image")
    document = b'{"images": [{"uri": "maps/a%20b.png"}, {"uri": "data:image/png;base64,AA=="}]}'
    chunk = len(document).to_bytes(4, "little") + b"JSON" + document
    glb = b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunk)).to_bytes(4, "little") + chunk
    (tmp_path / "a.gltf").write_bytes(document)
    (tmp_path / "a.glb").write_bytes(glb)

    for name in ("a.gltf", "a.glb"):
        assert read_local(tmp_path / name).resources == {"maps/a b.png": b"image"}
        assert files_of(tmp_path / name) == [tmp_path / name, tmp_path / "maps" / "a b.png"]


def test_damaged_files_name_nothing(tmp_path: Path) -> None:
    mesh = tmp_path / "a.glb"
    for data in (b"glTF", b"glTF" + b"\xff" * 16, b"glTF" + bytes(30), b'{"images": 3}', b"{"):
        mesh.write_bytes(data)

        assert read_local(mesh).resources == {}


def test_a_library_is_found_behind_a_byte_order_mark(tmp_path: Path) -> None:
    mesh = tmp_path / "a.obj"
    mesh.write_bytes(b"\xef\xbb\xbfmtllib a.mtl\nv 0 0 0\n")
    (tmp_path / "a.mtl").write_bytes(b"newmtl a\n")

    assert read_local(mesh).resources == {"a.mtl": b"newmtl a\n"}


def test_names_with_number_signs_are_found_and_so_are_those_before_a_comment(
    tmp_path: Path,
) -> None:
    mesh = tmp_path / "a.obj"
    mesh.write_text("mtllib set #1.mtl\nv 0 0 0\n")
    (tmp_path / "set #1.mtl").write_text("newmtl a\nmap_Kd b#2.png\nmap_Ks c.png # gloss\n")
    for name in ("b#2.png", "c.png"):
        (tmp_path / name).touch()

    assert set(read_local(mesh).resources) == {"set #1.mtl", "b#2.png", "c.png"}
