"""Closeness is proven from the files, whatever report, options and record say.

Each case leaves the hashes true of the files at hand: only the proof is left to object.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import igl
import numpy as np
import pytest
import trimesh

from meshcone.assets import Asset, read_asset
from meshcone.certificate.checks import Check
from meshcone.certificate.file import Closeness
from meshcone.files import MeshFile
from meshcone.quality.deviation.leaves import WEIGHT_PARTS, Leaves
from meshcone.surface.arrays import Floats
from tests.unit.certificate.closeness import FAST, check
from tests.unit.certificate.forging import Forgery, anywhere
from tests.unit.engine.evidence import Evidence
from tests.unit.engine.pairs import rough, smooth, with_a_seam

SMOOTH = smooth().data


@pytest.fixture(scope="module")
def cut(honest: Evidence) -> Leaves:
    leaves = record(honest).extra
    assert len(leaves.cut) > 10
    assert (leaves.count > 1).any()
    return leaves


def record(evidence: Evidence) -> Closeness:
    assert evidence.certificate.closeness is not None
    return evidence.certificate.closeness


def with_extra(evidence: Evidence, leaves: Leaves) -> Evidence:
    closeness = replace(record(evidence), extra=leaves)
    return evidence.with_certificate(closeness=closeness)


def test_what_is_said_is_true_of_samples_and_attained_at_a_point(honest: Evidence) -> None:
    words = check(honest).words
    extra, missing = (float(part.split(" units")[0]) for part in words.split("within ")[1:])
    refined, reference = (read_asset("a.obj", honest.refined.data), read_asset("b.obj", SMOOTH))

    deviation = honest.report.deviation
    assert deviation is not None
    for here, there, stated, told in (
        (refined, reference, extra, deviation.extra),
        (reference, refined, missing, deviation.missing),
    ):
        assert distances_of_samples(here, there).max() <= stated
        assert distances(np.array([told.at]), there)[0] > 0.99 * stated

    assert words.endswith("proven without a search")


def distances_of_samples(here: Asset, there: Asset) -> Floats:
    points, _ = trimesh.sample.sample_surface(
        trimesh.Trimesh(here.vertices, here.faces, process=False), 5000, seed=1
    )
    return distances(np.concatenate([points, here.vertices]), there)


def distances(points: Floats, there: Asset) -> Floats:
    squares, _, _ = igl.point_mesh_squared_distance(points, there.vertices, there.faces)
    return np.asarray(np.sqrt(squares))


Spoil = Callable[[Leaves], dict[str, Any]]

# What is done to the leaves of the refined surface, and what is said of it.
SPOILED: dict[str, tuple[Spoil, str]] = {
    "a cut left out": (
        lambda leaves: {key: getattr(leaves, key)[:-1] for key in ("cut", "edge", "at")},
        "a piece has no bound",
    ),
    "a leaf left out": (lambda leaves: {"count": leaves.count[:-1]}, "a piece has no bound"),
    "a leaf of no faces": (
        lambda leaves: {"count": changed(leaves.count, 0)},
        "a piece has no bound",
    ),
    "a piece cut twice": (
        lambda leaves: {"cut": np.sort(changed(leaves.cut, leaves.cut[1]))},
        "do not tile",
    ),
    "a piece cut before it is there": (
        lambda leaves: {"cut": changed(leaves.cut, 10**6, at=-1)},
        "do not tile",
    ),
    "a negative piece": (lambda leaves: {"cut": changed(leaves.cut, -1)}, "do not tile"),
    "a cut beyond its edge": (lambda leaves: {"at": changed(leaves.at, 1.5)}, "do not tile"),
    "a cut before its edge": (lambda leaves: {"at": changed(leaves.at, -0.5)}, "do not tile"),
    "a fourth edge": (lambda leaves: {"edge": changed(leaves.edge, 3)}, "do not tile"),
    "a face that is not there": (
        lambda leaves: {"faces": changed(leaves.faces, 10**6)},
        "a face that the reference does not have",
    ),
    "a negative face": (
        lambda leaves: {"faces": changed(leaves.faces, -1)},
        "a face that the reference does not have",
    ),
    "a negative weight": (
        lambda leaves: {"weights": changed(leaves.weights, -WEIGHT_PARTS)},
        "a weight that is not between 0 and 1",
    ),
    "weights of less than one": (
        lambda leaves: {"weights": leaves.weights // 2},
        "weights that do not add up to 1",
    ),
    "weights of nothing": (
        lambda leaves: {"weights": 0 * leaves.weights},
        "weights that do not add up to 1",
    ),
    "bounds cut short": (
        lambda leaves: {"faces": leaves.faces[:-1], "weights": leaves.weights[:-1]},
        "bounds that are not whole",
    ),
}


def changed(array: Any, value: float, at: int = 0) -> Any:
    copy = array.copy()
    copy[at] = value
    return copy


@pytest.mark.parametrize("name", SPOILED)
def test_a_record_that_proves_nothing_fails(honest: Evidence, cut: Leaves, name: str) -> None:
    spoil, said = SPOILED[name]

    found = check(with_extra(honest, replace(cut, **spoil(cut))))

    assert not found.ok
    assert "the record of 'extra' proves nothing" in found.words
    assert said in found.words


def test_leaves_bounded_by_other_faces_prove_less(honest: Evidence, cut: Leaves) -> None:
    far = with_extra(honest, replace(cut, faces=cut.faces[::-1].copy()))

    assert "'extra' is proven to be 4" in check(far, "deviation").words
    assert not check(far, "deviation").ok


def test_leaves_of_another_mesh_with_the_same_counts_prove_less(honest: Evidence) -> None:
    other = Evidence.of(rough(seed=8), smooth(), FAST)
    swapped = honest.with_certificate(closeness=record(other))

    assert not check(swapped, "deviation").ok


def test_leaves_of_a_mesh_with_other_counts_do_not_tile(honest: Evidence) -> None:
    both = record(honest)
    turned = honest.with_certificate(closeness=Closeness(both.missing, both.extra))

    assert "do not tile the mesh" in check(turned).words


def test_a_mesh_that_is_far_off_is_said_to_be(honest: Evidence) -> None:
    far = Forgery({**FAST, "surface": {"proximity": 1e6, "edge_cap": 1e6}}, before=anywhere).of(
        honest
    )

    assert check(far).words.startswith("every point within 4.63 units of the reference")


def test_a_record_that_only_the_report_has_fails(honest: Evidence) -> None:
    gone = honest.with_certificate(closeness=None)

    assert not check(gone).ok
    assert "the certificate does not" in check(gone).words


def test_a_record_that_the_report_is_silent_about_fails(honest: Evidence) -> None:
    assert "the report does not" in check(honest.with_report(deviation=None)).words


def test_closeness_is_searched_for_where_nobody_has_proven_it() -> None:
    made = Evidence.of(rough(), smooth(), {**FAST, "deviation": {"prove": False}})
    unproven = made.with_document(schema_="meshcone.certificate/1")

    found = check(unproven)

    assert unproven.failed() == set()
    assert found.ok
    assert found.words.endswith("found by a search, because no proof is stored")


def test_closeness_is_proven_where_the_alignment_brings_the_source() -> None:
    apart = rough()
    asset = read_asset(apart.name, apart.data)
    moved = MeshFile(apart.name, asset.patched(asset.vertices + np.array([3.0, 0, 0])))
    aligned = Evidence.of(moved, smooth(), {**FAST, "align": "rigid"})

    assert aligned.failed() == set()
    assert check(aligned).words.startswith("moved as aligned, every point within 0.0")


def test_a_refined_file_of_another_mesh_fails(honest: Evidence) -> None:
    first, *rest = honest.refined.data.splitlines()
    turned = b"\n".join([first, *rest[:-1], b"f 1 2 3"])
    other = replace(honest, refined=MeshFile("other.obj", turned)).with_forged_hashes()

    assert check(other).words == "the refined file has other vertices or faces than the source"


def test_a_seam_that_has_been_opened_counts() -> None:
    evidence = Evidence.of(with_a_seam(rough()), smooth(), FAST)
    lines = evidence.refined.data.splitlines()
    x, *yz = lines[66].split()[1:]
    lines[66] = b" ".join([b"v", b"%.9g" % (float(x) + 0.5), *yz])
    opened = replace(evidence, refined=MeshFile("open.obj", b"\n".join(lines)))

    assert bound(check(opened)) >= bound(check(evidence)) + 0.49


# Three vertices at one place that only a face without area uses, and what a forger does to them.
OPENED = {
    "a face of its own": ("f 67 68 69", {67: (50, 0, 0), 68: (0, 50, 0), 69: (0, 0, 50)}),
    "a face at two places": ("f 67 68 1", {67: (50, 0, 0), 68: (0, 50, 0)}),
    "a sliver": ("f 67 68 1", {67: (50, 0, 0), 68: (50, 0.01, 0)}),
    "a sliver between live corners": ("f 1 70 40", {70: (0.01, 0, 0)}),
}


@pytest.mark.parametrize("name", OPENED)
def test_a_face_without_area_that_is_opened_is_refused(name: str) -> None:
    face, moves = OPENED[name]
    evidence = Evidence.of(with_a_collapsed_face(face), smooth(), FAST)
    assert check(evidence).ok

    opened = replace(evidence, refined=moved(evidence.refined, moves)).with_forged_hashes()

    found = check(opened)
    assert not found.ok
    assert found.words.startswith("the refined file opens a triangle that is without area")


def test_a_face_without_area_may_be_elsewhere() -> None:
    evidence = Evidence.of(with_a_collapsed_face("f 67 68 1"), smooth(), FAST)
    moves = {67: (1.0, 2.0, 3.0), 68: (1.0, 2.0, 3.0)}
    elsewhere = replace(evidence, refined=moved(evidence.refined, moves)).with_forged_hashes()

    assert check(elsewhere).words == check(evidence).words


def with_a_collapsed_face(face: str) -> MeshFile:
    """Add vertices 67 to 69 at one place, 70 where the first is and used as it is, and a face."""
    lines = rough().data.decode().splitlines()
    apart = ["v 3 3 3"] * 3
    used = next(line for line in lines if line.startswith("f ") and "1" in line.split())
    again = " ".join("70" if corner == "1" else corner for corner in used.split())
    faces = [again if line is used else line for line in lines[66:]]
    return MeshFile("rough.obj", "\n".join([*lines[:66], *apart, lines[0], *faces, face]).encode())


def moved(refined: MeshFile, moves: dict[int, tuple[float, float, float]]) -> MeshFile:
    """Move vertices of an OBJ, counted from 1."""
    lines = refined.data.decode().splitlines()
    for vertex, by in moves.items():
        place = (float(x) + d for x, d in zip(lines[vertex - 1].split()[1:], by, strict=True))
        lines[vertex - 1] = "v " + " ".join(f"{x:.9g}" for x in place)
    return MeshFile(refined.name, "\n".join(lines).encode())


def bound(found: Check) -> float:
    return float(found.words.split("within ")[1].split()[0])
