"""Meshes on this machine, and the files beside them."""

from __future__ import annotations

import json
import os
from pathlib import Path

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
