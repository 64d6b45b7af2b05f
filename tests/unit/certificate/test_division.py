"""A source whose faces were divided: what is proven of that, and forgeries that fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.certificate.division import DivisionRecord
from meshcone.certificate.file import read_certificate
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.surface import Subdivision
from meshcone.surface.arrays import Ints
from meshcone.verbs.verify import verify
from tests.shapes import noisy, sphere
from tests.unit.assets.bisecting import bisected
from tests.unit.engine.evidence import Evidence

FAST: dict[str, Any] = {"effort": "fast"}


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
SUBDIVISION = bisected(read_asset(SOURCE.name, SOURCE.data).faces, range(0, 200, 7))


@pytest.fixture(scope="module")
def honest() -> Evidence:
    """What refining the divided source makes, said of the source itself."""
    divided = read_asset(SOURCE.name, SOURCE.data).divided(SUBDIVISION)
    made = Evidence.of(MeshFile(SOURCE.name, divided), REFERENCE, FAST)
    of_source = replace(made, source=SOURCE).with_forged_hashes()
    return of_source.with_certificate(division=DivisionRecord.of(SUBDIVISION))


def lines(evidence: Evidence) -> dict[str, tuple[bool, str]]:
    stored = MeshFile("certificate.npz", evidence.certificate.to_bytes())
    checks = verify(
        evidence.report, stored, evidence.source, evidence.reference, evidence.refined
    ).checks
    return {check.name: (check.ok, check.words) for check in checks}


def test_a_division_is_proven_with_all_that_is_proven_without(honest: Evidence) -> None:
    assert honest.failed() == set()
    found = lines(honest)
    assert found["division"][1].startswith(
        f"{np.count_nonzero(SUBDIVISION.divided[SUBDIVISION.parents]):,} faces tile "
        f"{np.count_nonzero(SUBDIVISION.divided):,} of the 32 of the source"
    )
    assert found["attributes"][1].startswith("COLOR_0, TEXCOORD_0, materials: what lies there")
    assert "byte for byte" in found["written"][1]


def test_it_is_read_as_it_was_stored(honest: Evidence) -> None:
    again = read_certificate(honest.certificate.to_bytes(), "again")
    assert again.arrays_equal(honest.certificate)
    assert again.division is not None
    faces = read_asset(SOURCE.name, SOURCE.data).faces
    checked = again.division.checked(faces)
    assert np.array_equal(checked.parents, SUBDIVISION.parents)
    assert np.array_equal(checked.corners, SUBDIVISION.corners)


def test_without_it_the_refined_file_is_of_another_mesh(honest: Evidence) -> None:
    assert {"closeness", "program"} <= honest.with_certificate(division=None).failed()


def forged(record: DivisionRecord, change: Callable[[Ints, Ints], tuple[Ints, Ints]]) -> Any:
    parents, corners = change(record.parents.copy(), record.corners.copy())
    return replace(record, parents=parents, corners=corners)


def without_a_child(parents: Ints, corners: Ints) -> tuple[Ints, Ints]:
    return parents[1:], corners[1:]


def one_child_twice(parents: Ints, corners: Ints) -> tuple[Ints, Ints]:
    return np.insert(parents, 0, parents[0]), np.insert(corners, 0, corners[0], axis=0)


def one_child_in_the_place_of_another(parents: Ints, corners: Ints) -> tuple[Ints, Ints]:
    corners[1] = corners[0]
    return parents, corners


def a_child_turned_over(parents: Ints, corners: Ints) -> tuple[Ints, Ints]:
    corners[0] = corners[0, ::-1]
    return parents, corners


def a_child_outside(parents: Ints, corners: Ints) -> tuple[Ints, Ints]:
    corners[0] += [[-1, 1]] * 3
    corners[0, 0] = (65, -1)
    return parents, corners


def a_corner_below_zero(parents: Ints, corners: Ints) -> tuple[Ints, Ints]:
    corners[0, 0] = (-64, 64)
    return parents, corners


def swapped_parents(parents: Ints, corners: Ints) -> tuple[Ints, Ints]:
    first, second = np.unique(parents)[:2]
    counts = [np.count_nonzero(parents == each) for each in (first, second)]
    one, other = np.flatnonzero(parents == first), np.flatnonzero(parents == second)
    rest = np.setdiff1d(np.arange(len(parents)), np.concatenate([one, other]))
    names = np.repeat([first, second], counts[::-1])
    return np.concatenate([names, parents[rest]]), corners[np.concatenate([other, one, rest])]


def a_parent_beyond(parents: Ints, corners: Ints) -> tuple[Ints, Ints]:
    parents[-1] = 32
    return parents, corners


def a_parent_below(parents: Ints, corners: Ints) -> tuple[Ints, Ints]:
    parents[0] = -1
    return parents, corners


def huge_numbers(parents: Ints, corners: Ints) -> tuple[Ints, Ints]:
    corners[0] += 2**62
    return parents, corners


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (without_a_child, "cover less than it"),
        (one_child_twice, "cover more than it"),
        (one_child_in_the_place_of_another, "of the source"),
        (a_child_turned_over, "turned over"),
        (a_child_outside, "a child lies outside of face"),
        (a_corner_below_zero, "a child lies outside of face"),
        (swapped_parents, "share a side divide it at different points"),
        (a_parent_beyond, "a face that the source does not have"),
        (a_parent_below, "a face that the source does not have"),
        (huge_numbers, "a child lies outside of face"),
    ],
)
def test_a_record_that_is_no_division_of_the_source_fails(
    honest: Evidence, change: Callable[[Ints, Ints], tuple[Ints, Ints]], words: str
) -> None:
    assert honest.certificate.division is not None
    record = forged(honest.certificate.division, change)
    ok, found = lines(honest.with_certificate(division=record))["division"]
    assert not ok
    assert words in found


@pytest.mark.parametrize("exponent", [-1, 5, 7, 27, 2**40])
def test_an_exponent_that_is_not_the_division_s_fails(honest: Evidence, exponent: int) -> None:
    assert honest.certificate.division is not None
    record = replace(honest.certificate.division, exponent=exponent)
    assert "division" in honest.with_certificate(division=record).failed()


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
    arrays = DivisionRecord.of(SUBDIVISION).arrays() | {name: array}
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
    assert "other vertices or faces than the source" in words


def test_whole_faces_take_no_room() -> None:
    record = DivisionRecord.of(bisected(sphere(4)[1], [5]))
    assert len(record.parents) == 4
    assert DivisionRecord.of(Subdivision.none(9)).parents.size == 0
