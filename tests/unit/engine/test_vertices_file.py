"""Pinned vertices in a file of their own."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import meshcone
from meshcone.errors import InputError, LimitError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.refine import refine
from meshcone.verbs.verify import read_report, verify
from meshcone.vertex_list import LIST_BYTES, listed_vertices
from tests import shapes

NAMED = {"effort": "fast", "cones": {"pin": {"vertices_file": "pins"}}}
LISTED = {"effort": "fast", "cones": {"pin": {"vertices": [0, 3, 17]}}}


def pair() -> tuple[MeshFile, MeshFile]:
    vertices, faces = shapes.sphere(1)
    source = MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces))
    return source, MeshFile("ball.obj", shapes.obj(vertices, faces))


@pytest.mark.parametrize("data", [b"[17, 0, 3]", b"0 3\n17\n", b"\xef\xbb\xbf[0,3,17,17]"])
def test_a_file_pins_the_vertices_that_a_list_would(data: bytes) -> None:
    source, reference = pair()

    listed = refine(source, reference, parse_options(LISTED))
    named = refine(replace(source, resources={"pins": data}), reference, parse_options(NAMED))

    assert named.data == listed.data
    assert named.data != refine(source, reference, parse_options({"effort": "fast"})).data


def test_the_report_has_the_files_hash_and_verify_notices_another() -> None:
    source, reference = pair()
    with_list = replace(source, resources={"pins": b"[0, 3, 17]"})
    done = refine(with_list, reference, parse_options(NAMED))
    report = read_report(done.report.model_dump_json().encode(), "report.json")
    certificate = MeshFile("c.npz", done.certificate or b"")
    refined = MeshFile(done.name, done.data)

    assert report.inputs.source.resources == with_list.resource_hashes
    assert verify(report, certificate, with_list, reference, refined).ok
    other = replace(source, resources={"pins": b"[0, 3, 16]"})
    assert not verify(report, certificate, other, reference, refined).ok


def test_the_file_is_found_beside_the_source_by_refine_and_verify(tmp_path: Path) -> None:
    source, reference = pair()
    for file in (source, reference):
        (tmp_path / file.name).write_bytes(file.data)
    (tmp_path / "pins").write_text("0 3 17")

    done = meshcone.refine(tmp_path / source.name, tmp_path / reference.name, **NAMED)

    assert done.data == refine(source, reference, parse_options(LISTED)).data
    done.save(tmp_path / "out.obj", report=tmp_path / "report.json")
    assert meshcone.verify(
        tmp_path / "report.json",
        source=tmp_path / source.name,
        reference=tmp_path / reference.name,
        refined=tmp_path / "out.obj",
    )
    with pytest.raises(InputError):
        done.save(tmp_path / "out.obj", report=tmp_path / "pins")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"[0, 42]", "names vertex 42; the source has 42"),
        (b"[0, -1]", "expected indices of vertices"),
        (b"[0, 1.5]", "expected indices of vertices"),
        (b"[true]", "expected indices of vertices"),
        (b"0, 1", "expected indices of vertices"),
        (b'["0"]', "expected indices of vertices"),
        (b"\xff\xfe", "expected indices of vertices"),
        (b"[" * 100_000, "expected indices of vertices"),
        (b"9" * 5_000, "expected indices of vertices"),
    ],
)
def test_what_is_no_list_of_the_sources_vertices_is_refused(data: bytes, said: str) -> None:
    with pytest.raises(InputError, match=said):
        listed_vertices(parse_options(NAMED), {"pins": data}, 42)


def test_a_file_that_is_not_there_or_too_long_is_refused() -> None:
    with pytest.raises(InputError, match="names 'pins', which was not sent"):
        listed_vertices(parse_options(NAMED), {}, 42)
    with pytest.raises(LimitError, match="accepted"):
        listed_vertices(parse_options(NAMED), {"pins": b" " * (LIST_BYTES + 1)}, 42)


@pytest.mark.parametrize("name", ["a/b", "..", "a\\b", "a\0", ""])
def test_a_name_with_a_folder_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=r"cones\.pin\.vertices_file"):
        parse_options({"cones": {"pin": {"vertices_file": name}}})


def test_a_file_of_half_a_million_vertices_is_read() -> None:
    data = json.dumps([0] * 520_000).encode()

    assert np.array_equal(listed_vertices(parse_options(NAMED), {"pins": data}, 1), [0])
