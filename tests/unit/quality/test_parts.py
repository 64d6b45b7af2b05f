"""Distances of each part of two surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.quality.parts import LISTED, Partition, PartSamples, distances_per_part
from meshcone.quality.records import Part, PerPart
from meshcone.surface import Frame, Mesh, SurfaceTree
from meshcone.verbs.measure import measure
from tests import shapes
from tests.truck import truck_mesh, truck_obj

FRAME = Frame(np.zeros(3), 1.0)
WHOLE = {"samples": 500, "emd_samples": 16}


def per_part(mesh: bytes, reference: bytes, by: str = "node") -> PerPart:
    options = parse_options({"mode": "measure", "quality": {**WHOLE, "per": by}})
    per = measure(MeshFile("a.obj", mesh), MeshFile("b.obj", reference), options).quality.per
    assert per is not None
    return per


def part(per: PerPart, name: str) -> Part:
    [found] = [each for each in per.parts if each.name == name]
    return found


def test_a_wheel_that_is_not_there_is_missing_and_comes_first() -> None:
    per = per_part(truck_obj(without=["wheel_front_left"]), truck_obj())

    assert (per.count, per.missing, per.extra) == (5, 1, 0)
    assert (per.parts[0].name, per.parts[0].found) == ("wheel_front_left", "missing")
    assert per.parts[0].extra is None
    assert [each.found for each in per.parts[1:]] == ["both"] * 4


def test_a_wheel_that_the_reference_lacks_is_extra() -> None:
    per = per_part(truck_obj(), truck_obj(without=["wheel_back_right"]))

    assert part(per, "wheel_back_right").found == "extra"
    assert (per.missing, per.extra) == (0, 1)


def test_a_part_with_another_name_is_not_missing() -> None:
    renamed = truck_obj().replace(b"o wheel_front_left", b"o front_left")

    per = per_part(renamed, truck_obj())

    assert (per.missing, per.extra) == (0, 0)
    assert part(per, "front_left").missing is None
    assert part(per, "wheel_front_left").extra is None


def test_only_the_part_that_is_off_is_told_to_be() -> None:
    moved = truck_mesh("wheel_back_left").vertices + np.array([0, 0.1, 0])

    per = per_part(truck_obj(instead={"wheel_back_left": moved}), truck_obj())

    assert per.parts[0].name == "wheel_back_left"
    assert all(each.extra is not None and each.extra.max < 1e-6 for each in per.parts[1:])


def test_every_part_is_sampled_however_small() -> None:
    vertices, faces = shapes.sphere(3, 1.0)
    speck = vertices[faces[0]] * 1e-3
    corners = len(vertices) + np.arange(3)
    mesh = Mesh(np.concatenate([vertices, speck]), np.concatenate([faces, corners[None]]))
    labels = np.zeros(len(mesh.faces), dtype=np.int64)
    labels[-1] = 1

    samples = PartSamples.of(mesh, Partition(("ball", "speck"), labels), SurfaceTree(mesh), 100)

    assert samples.sampled.tolist() == [356, 256]
    points, distances, count = samples.of_part(1)
    assert count == 256
    assert np.abs(points).max() <= 1e-3
    assert np.array_equal(points[256:], speck)
    assert distances.max() < 1e-12


def test_the_samples_of_a_part_lie_on_its_faces() -> None:
    mesh = Mesh(*shapes.sphere(2, 1.0))
    labels = np.arange(len(mesh.faces)) % 7

    samples = PartSamples.of(mesh, Partition(tuple("abcdefg"), labels), SurfaceTree(mesh), 700)

    for number in range(7):
        points, _, count = samples.of_part(number)
        own = SurfaceTree(Mesh(mesh.vertices, mesh.faces[labels == number]))
        assert count >= 256
        assert own.closest(points).distances.max() < 1e-12


def test_a_part_without_area_is_no_part() -> None:
    mesh = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 1, 1]]))
    samples = PartSamples.of(
        mesh, Partition(("whole", "flat"), np.array([0, 1])), SurfaceTree(mesh), 10
    )

    per = distances_per_part("node", samples, samples, FRAME, None, None)

    assert [each.name for each in per.parts] == ["whole"]


def test_of_thousands_of_parts_the_worst_are_listed() -> None:
    vertices, faces = shapes.sphere(3, 1.0)
    mesh = Mesh(vertices, faces)
    names = Partition(tuple(map(str, range(len(faces)))), np.arange(len(faces)))
    off = mesh.moved_to(vertices + np.array([0.3, 0, 0]))

    per = distances_per_part(
        "mesh",
        PartSamples.of(off, names, SurfaceTree(mesh), 10),
        PartSamples.of(mesh, names, SurfaceTree(off), 10),
        FRAME,
        None,
        None,
    )

    assert (per.count, len(per.parts)) == (len(faces), LISTED)
    means = [
        max(each.missing.mean, each.extra.mean) for each in per.parts if each.missing and each.extra
    ]
    assert means == sorted(means, reverse=True)


@pytest.mark.parametrize(
    ("by", "names"),
    [
        ("node", ("left", "right")),
        ("group", ("a", "b")),
        ("material", ("red",)),
    ],
)
def test_an_obj_is_divided_by_its_statements(by: str, names: tuple[str, ...]) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\no left\ng a\nf 1 2 3\no right\ng b\nf 3 2 1\n"

    found, labels = read_asset("two.obj", text.encode()).parts(by)

    assert {found[label] for label in labels} == set(names)


def test_a_mesh_without_parts_is_one_part_without_a_name() -> None:
    names, labels = read_asset("ball.obj", shapes.obj(*shapes.sphere(1))).parts("material")

    assert names == ("",)
    assert not labels.any()


def two_points_each(distances: list[float], areas: list[float]) -> PartSamples:
    """Parts named a, b, c, … of two samples each, 2 apart, all of a part as far away."""
    count = len(distances)
    return PartSamples(
        Partition(tuple("abcdefg"[:count]), np.arange(count)),
        points=np.tile(np.array([[0, 0, 0], [2, 0, 0.0]]), (count, 1)),
        distances=np.repeat(distances, 2),
        parts=np.repeat(np.arange(count), 2),
        sampled=np.full(count, 2),
        areas=np.array(areas),
    )


@pytest.mark.parametrize(("areas", "usual"), [([3.0, 2.0], 0.0), ([2.0, 3.0], 0.3)])
def test_the_usual_distance_is_that_of_half_the_area(areas: list[float], usual: float) -> None:
    assert two_points_each([0.0, 0.3], areas).usual == usual


@pytest.mark.parametrize(
    ("names", "distance", "absent"),
    [
        ({"b", "c"}, 0.1, True),  # most parts kept their names, and this one is not there
        ({"b", "c"}, 0.04, False),
        ({"a", "b", "c"}, 0.1, False),  # a part of its name is there
        ({"b"}, 0.1, False),  # most names are others: nothing follows from this one
        (set(), 0.1, False),
        ({"a", "b", "c"}, 0.3, True),  # farther away than a quarter of its own size
        (set(), 0.3, True),
    ],
)
def test_less_distance_is_enough_where_a_part_alone_has_lost_its_name(
    names: set[str], distance: float, absent: bool
) -> None:
    samples = two_points_each([distance, 0.0, 0.0], [1.0, 1.0, 1.0])

    assert samples.absent(names).tolist() == [absent, False, False]


@pytest.mark.parametrize(("distance", "absent"), [(0.28, False), (0.35, True)])
def test_a_part_is_absent_that_is_three_times_as_far_away_as_is_usual(
    distance: float, absent: bool
) -> None:
    samples = two_points_each([distance, 0.1, 0.1], [1.0, 1.0, 1.0])

    assert samples.absent({"a", "b", "c"}).tolist() == [absent, False, False]
