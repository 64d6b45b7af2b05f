"""Names that hold half of a surrogate pair, from JSON or from a file system, end in words."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.local_files import read_local
from meshcone.options import parse_options
from meshcone.verbs.measure import measure
from service.gating.pairs import shown
from tests import shapes

MEASURED = parse_options(
    {"mode": "measure", "quality": {"samples": 256, "emd_samples": 64, "curvature_samples": 64}}
)


@pytest.fixture
def ball() -> MeshFile:
    return MeshFile("ball.obj", shapes.obj(*shapes.sphere(1)))


def test_a_file_whose_name_is_no_text_is_measured(tmp_path: Path, ball: MeshFile) -> None:
    path = tmp_path / os.fsdecode(b"\xff.obj")
    path.write_bytes(ball.data)

    report = json.loads(measure(read_local(path), ball, MEASURED).model_dump_json())

    assert report["inputs"]["source"]["name"] == "\\udcff.obj"
    assert shown(path).encode().endswith(b"\\udcff.obj")


def test_a_gltf_that_names_a_buffer_by_half_a_character_is_refused_in_words(
    tmp_path: Path, ball: MeshFile
) -> None:
    document, _ = shapes.gltf(*shapes.sphere(1), "HALF")
    path = tmp_path / "a.gltf"
    path.write_bytes(document.replace(b"HALF", b"\\ud800"))

    with pytest.raises(InputError) as refused:
        measure(read_local(path), ball, MEASURED)

    assert str(refused.value).encode() == (
        b"a.gltf, /buffers/0/uri: '\\ud800' is not the name of a file sent along"
    )
