"""A source whose faces were divided: what is proven of that, and forgeries that fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshcone.certificate.dividing import divide
from meshcone.certificate.division import DivisionRecord
from meshcone.certificate.file import read_certificate
from meshcone.detail.records import DetailRecord
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.pair import read_pair
from meshcone.surface import Subdivision
from meshcone.surface.charts import Charts
from meshcone.verbs.replay import verify_by_replay
from meshcone.verbs.verify import verify
from tests.shapes import noisy, sphere
from tests.unit.assets.bisecting import bisected
from tests.unit.engine.evidence import Evidence


def textured(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    """A texture with a seam, colours, and two materials."""
    lines = [
        f"v {x:.6f} {y:.6f} {z:.6f} {abs(x) / 3:.4f} 0.5 {abs(z) / 3:.4f}" for x, y, z in vertices
    ]
    lines += [f"vt {x / 5 + 0.5:.6f} {y / 5 + 0.5:.6f}" for x, y, _ in vertices]
    lines += [f"vt {y / 7 + 0.5:.6f} {z / 7 + 0.5:.6f}" for _, y, z in vertices]
    for number, corners in enumerate(faces + 1):
        if number % (len(faces) // 2) == 0:
            lines.append(f"usemtl part{number}")
        shift = 0 if number < len(faces) // 2 else len(vertices)
        lines.append("f " + " ".join(f"{corner}/{corner + shift}" for corner in corners))
    return ("\n".join(lines) + "\n").encode()


VERTICES, FACES = sphere(1)
SOURCE = MeshFile("source.obj", textured(noisy(VERTICES, 0.02), FACES))
REFERENCE = MeshFile("reference.obj", textured(*sphere(3)))


FEW: dict[str, Any] = {"samples": 500, "emd_samples": 16, "curvature_samples": 16}
OPTIONS: dict[str, Any] = {"effort": "fast", "quality": FEW, "detail": {"growth": 3}}


@pytest.fixture(scope="module")
def honest() -> Evidence:
    return Evidence.of(SOURCE, REFERENCE, OPTIONS)


def lines(evidence: Evidence) -> dict[str, tuple[bool, str]]:
    stored = MeshFile("certificate.npz", evidence.certificate.to_bytes())
    checks = verify(
        evidence.report, stored, evidence.source, evidence.reference, evidence.refined
    ).checks
    return {check.name: (check.ok, check.words) for check in checks}


def test_a_division_is_proven_with_all_that_is_proven_without(honest: Evidence) -> None:
    assert honest.failed() == set()
    found, told = lines(honest), honest.report.detail
    assert told is not None
    children = told.faces_after - told.faces_before + told.divided
    words = f"{children} faces tile {told.divided} of the {told.faces_before} of the source"
    assert found["division"][1].startswith(words)
    assert found["attributes"][1].startswith("COLOR_0, TEXCOORD_0, materials: what lies there")
    assert "byte for byte" in found["written"][1]


def test_it_is_replayed(honest: Evidence) -> None:
    stored = MeshFile("certificate.npz", honest.certificate.to_bytes())
    files = (honest.source, honest.reference, honest.refined)
    assert verify_by_replay(honest.report, stored, *files).ok


def test_it_is_read_as_it_was_stored(honest: Evidence) -> None:
    again = read_certificate(honest.certificate.to_bytes(), "again")
    assert again.arrays_equal(honest.certificate)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 10_000), max_size=12))
def test_any_division_is_read_as_it_was_stored(picks: list[int]) -> None:
    division = bisected(FACES, picks)
    checked = DivisionRecord.of_arrays(DivisionRecord.of(division).arrays()).checked(
        FACES, lambda: Charts.alone(FACES)
    )
    assert np.array_equal(checked.parents, division.parents)
    assert np.array_equal(checked.corners, division.corners)


def test_without_it_the_refined_file_is_of_another_mesh(honest: Evidence) -> None:
    assert lines(honest.with_certificate(division=None))["division"] == (
        False,
        "the report states that faces were divided, the certificate does not",
    )


# Each forges a record whose arrays are its own.
def without_a_child(record: DivisionRecord) -> DivisionRecord:
    return replace(record, parents=record.parents[1:], corners=record.corners[1:])


def one_child_twice(record: DivisionRecord) -> DivisionRecord:
    rows = np.array([0, *range(len(record.parents))])
    return replace(record, parents=record.parents[rows], corners=record.corners[rows])


def one_child_in_the_place_of_another(record: DivisionRecord) -> DivisionRecord:
    record.corners[1] = record.corners[0]
    return record


def a_child_turned_over(record: DivisionRecord) -> DivisionRecord:
    return replace(record, corners=record.corners[:, ::-1])


def a_corner_beyond(record: DivisionRecord) -> DivisionRecord:
    record.corners[0, 0] = (2**record.exponent + 1, 0)
    return record


def a_corner_below_zero(record: DivisionRecord) -> DivisionRecord:
    record.corners[0, 0] = (-1, 1)
    return record


def swapped_parents(record: DivisionRecord) -> DivisionRecord:
    """Two faces with different numbers of children, each with those of the other."""
    parents = record.parents
    counts = np.bincount(parents, minlength=len(FACES))
    first = int(parents[0])
    second = next(face for face in range(len(FACES)) if counts[face] not in (0, counts[first]))
    other = np.where(parents == first, second, np.where(parents == second, first, parents))
    order = np.argsort(other, kind="stable")
    return replace(record, parents=other[order], corners=record.corners[order])


def a_parent_beyond(record: DivisionRecord) -> DivisionRecord:
    record.parents[-1] = len(FACES)
    return record


def a_parent_below(record: DivisionRecord) -> DivisionRecord:
    record.parents[0] = -1
    return record


def huge_numbers(record: DivisionRecord) -> DivisionRecord:
    record.corners[0] += 2**62
    return record


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (without_a_child, "cover less than it"),
        (one_child_twice, "cover more than it"),
        (one_child_in_the_place_of_another, "overlap"),
        (a_child_turned_over, "turned over"),
        (a_corner_beyond, "a child lies outside of face"),
        (a_corner_below_zero, "a child lies outside of face"),
        (swapped_parents, "share a side divide it at different points"),
        (a_parent_beyond, "a face that the source does not have"),
        (a_parent_below, "a face that the source does not have"),
        (huge_numbers, "a child lies outside of face"),
    ],
)
def test_a_record_that_is_no_division_of_the_source_fails(
    honest: Evidence, change: Callable[[DivisionRecord], DivisionRecord], words: str
) -> None:
    record = honest.certificate.division
    assert record is not None
    forged = change(replace(record, parents=+record.parents, corners=+record.corners))
    ok, found = lines(honest.with_certificate(division=forged))["division"]
    assert not ok
    assert words in found


@pytest.mark.parametrize("other", [lambda _: -1, lambda e: e - 1, lambda e: e + 1, lambda _: 2**40])
def test_an_exponent_that_is_not_the_division_s_fails(
    honest: Evidence, other: Callable[[int], int]
) -> None:
    record = honest.certificate.division
    assert record is not None
    forged = replace(record, exponent=other(record.exponent))
    assert "division" in honest.with_certificate(division=forged).failed()


def test_a_report_that_states_other_numbers_of_faces_fails(honest: Evidence) -> None:
    assert honest.report.detail is not None
    other = honest.report.detail.model_copy(update={"divided": 1})
    ok, words = lines(honest.with_report(detail=other))["division"]
    assert (ok, words) == (False, "the report states other numbers of faces than the division has")


def test_the_record_of_another_mesh_fails(honest: Evidence) -> None:
    other = DivisionRecord.of(bisected(sphere(2)[1], [3, 5]))
    ok, words = lines(honest.with_certificate(division=other))["division"]
    assert (ok, words) == (False, "the division is of 128 faces, the source has 32")


def test_another_division_of_the_same_mesh_fails(honest: Evidence) -> None:
    other = DivisionRecord.of(bisected(FACES, range(1, 200, 7)))
    assert "division" in honest.with_certificate(division=other).failed()


@pytest.mark.parametrize(
    ("name", "array"),
    [
        ("parents", np.full(3, np.nan)),
        ("corners", np.full((3, 3, 2), np.nan)),
        ("corners", np.zeros((3, 3, 3), dtype=np.int64)),
        ("shape", np.zeros(3, dtype=np.int64)),
        ("another", np.zeros(3, dtype=np.int64)),
    ],
)
def test_arrays_of_other_types_or_shapes_are_no_record(name: str, array: np.ndarray) -> None:
    arrays = DivisionRecord.of(bisected(FACES, [3, 5])).arrays() | {name: array}
    with pytest.raises(InputError, match="division"):
        DivisionRecord.of_arrays(arrays)


def changed(honest: Evidence, before: bytes, after: bytes) -> Evidence:
    """The refined file with other text, and hashes that are its own."""
    data = honest.refined.data.replace(before, after, 1)
    assert data != honest.refined.data
    return replace(honest, refined=replace(honest.refined, data=data)).with_forged_hashes()


def line_of(data: bytes, keyword: bytes, number: int) -> bytes:
    return [line for line in data.split(b"\n") if line.startswith(keyword + b" ")][number]


@pytest.mark.parametrize("number", [3, -1], ids=["of the source", "new"])
def test_a_texture_coordinate_moved_by_a_thousandth_fails(honest: Evidence, number: int) -> None:
    line = line_of(honest.refined.data, b"vt", number)
    u, v = map(float, line.split()[1:])
    found = lines(changed(honest, line + b"\n", b"vt %.8f %.8f\n" % (u, v + 0.001)))
    ok, words = found["attributes"]
    assert not ok
    assert words.startswith("TEXCOORD_0 of face")
    assert "is 0.001 from what lies there in the source" in words
    assert found["closeness"][0]


def test_a_colour_changed_by_a_thousandth_fails(honest: Evidence) -> None:
    line = line_of(honest.refined.data, b"v", -1)
    *words, blue = line.split()
    other = b" ".join([*words, b"%.9g" % (float(blue) + 0.001)])
    ok, told = lines(changed(honest, line, other))["attributes"]
    assert not ok
    assert told.startswith("COLOR_0 of face")


def test_a_face_under_another_material_fails(honest: Evidence) -> None:
    data = honest.refined.data
    start = data.index(b"usemtl part16")
    line = data[: start - 1].rpartition(b"\n")[2]
    moved = changed(honest, line + b"\nusemtl part16\n", b"usemtl part16\n" + line + b"\n")
    ok, words = lines(moved)["attributes"]
    assert not ok
    assert "has another material than the one it lies in" in words


def test_an_added_face_fails(honest: Evidence) -> None:
    data = honest.refined.data + b"f 1/1 2/2 3/3\n"
    added = replace(honest, refined=replace(honest.refined, data=data)).with_forged_hashes()
    ok, words = lines(added)["division"]
    assert not ok
    assert words.startswith("the refined file has ")
    assert "triangles, the source divided so has " in words


# A square that is not divided, beside a triangle that is.
SQUARE = b"""v 0 0 0
v 2 0 0
v 2 2 0
v 0 2 0
v 3 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3 4/4
f 5/1 2/2 3/3
"""


@pytest.mark.parametrize(("texture", "holds"), [(b"vt 1 1\n", True), (b"vt 1 1.001\n", False)])
def test_a_polygon_that_is_split_otherwise_where_it_was_moved_to_is_compared_too(
    honest: Evidence, texture: bytes, holds: bool
) -> None:
    options = parse_options(OPTIONS)
    pair = read_pair(MeshFile("square.obj", SQUARE), REFERENCE, options).under(options)
    halves = bisected(pair.source_asset.faces, [5])
    divided = pair.divided(halves, options)
    dented = divided.source_asset.vertices.copy()
    dented[3] = (1.5, 0.5, 0)  # now the diagonal runs from there
    refined = divided.source_asset.patched(dented).replace(b"vt 1 1\n", texture)
    again = divided.read_patched(refined)
    assert not np.array_equal(again.triangles, divided.source_asset.triangles)
    most = options.detail.faces_allowed(3)
    told = DetailRecord(
        faces_before=3, faces_after=4, faces_allowed=most, divided=1, levels=1, stopped="budget"
    )
    report = honest.report.model_copy(update={"detail": told})
    _, checks = divide(pair, DivisionRecord.of(halves), report, refined)
    assert [check.ok for check in checks] == [True, holds]


# The last vertex is in the middle of a side of the first face: the third one has no width.
BESIDE = b"""v 0 0 0
v 2 0 0
v 0 2 0
v 2 2 1
v 1 1 0
usemtl one
f 1 2 3
usemtl two
f 2 4 5
f 3 2 5
usemtl three
f 5 4 3
"""


def test_a_new_vertex_that_falls_on_one_that_is_there_is_that_one(honest: Evidence) -> None:
    options = parse_options(OPTIONS)
    pair = read_pair(MeshFile("beside.obj", BESIDE), REFERENCE, options).under(options)
    corners = [[[2, 0, 0], [0, 2, 0], [0, 1, 1]], [[2, 0, 0], [0, 1, 1], [0, 0, 2]]]
    sliver = [[[2, 0, 0], [1, 1, 0], [0, 0, 2]], [[1, 1, 0], [0, 2, 0], [0, 0, 2]]]
    own = [(2 * np.eye(3, dtype=int)).tolist()]
    division = Subdivision(
        4, np.array([0, 0, 1, 2, 2, 3]), np.array(corners + own + sliver + own), 1
    )
    divided = pair.divided(division, options)
    assert len(divided.source.faces) == 4  # those that are left of the narrow one have no area
    assert len(divided.source.vertices) == 5
    most = options.detail.faces_allowed(4)
    told = DetailRecord(
        faces_before=4, faces_after=6, faces_allowed=most, divided=2, levels=1, stopped="budget"
    )
    report = honest.report.model_copy(update={"detail": told})
    refined = divided.source_asset.patched(divided.source_asset.vertices * 1.5)
    _, checks = divide(pair, DivisionRecord.of(division), report, refined)
    assert [check.ok for check in checks] == [True, True]


def test_whole_faces_take_no_room() -> None:
    record = DivisionRecord.of(bisected(sphere(4)[1], [5]))
    assert len(record.parents) == 4
    assert DivisionRecord.of(Subdivision.none(9)).parents.size == 0
