"""Parts that one of two files lacks, by name or by place."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from meshcone.files import MeshFile
from meshcone.notices import WarningRecord
from meshcone.options import parse_options
from meshcone.verbs.measure import measure
from tests import shapes
from tests.truck import WHEELS, truck_mesh, truck_obj

QUICK = parse_options(
    {"mode": "measure", "audit": False, "quality": {"samples": 200, "emd_samples": 16}}
)


def pieces(source: bytes, reference: bytes) -> list[WarningRecord]:
    report = measure(MeshFile("truck.obj", source), MeshFile("master.obj", reference), QUICK)
    named = ("pieces.missing", "pieces.extra", "pieces.displaced")
    return [each for each in report.warnings if each.code in named]


def in_one_mesh(truck: bytes) -> bytes:
    return b"\n".join(line for line in truck.splitlines() if not line.startswith(b"o ")) + b"\n"


@pytest.mark.parametrize("wheel", WHEELS)
def test_a_missing_wheel_is_missed_by_name(wheel: str) -> None:
    [found] = pieces(truck_obj(without=[wheel]), truck_obj())

    assert (found.code, found.side, found.where) == ("pieces.missing", "reference", wheel)
    assert found.words == f"{wheel}: missing."


def test_a_wheel_too_many_is_extra() -> None:
    [found] = pieces(truck_obj(), truck_obj(without=["wheel_back_left"]))

    assert (found.code, found.side) == ("pieces.extra", "source")
    assert found.where == "wheel_back_left"


def test_without_names_a_missing_piece_is_told_by_its_place() -> None:
    source = in_one_mesh(truck_obj(without=["wheel_front_left"]))

    [found] = pieces(source, in_one_mesh(truck_obj()))

    assert found.code == "pieces.missing"
    assert found.words == "A piece near (1.2, 0.9, -0.5): missing."


def test_a_wheel_elsewhere_is_displaced() -> None:
    away = truck_mesh("wheel_front_left").vertices + np.array([0, 2.0, 0])

    [found] = pieces(truck_obj(instead={"wheel_front_left": away}), truck_obj())

    assert (found.code, found.where) == ("pieces.displaced", "wheel_front_left")


@pytest.mark.parametrize(
    "source",
    [
        pytest.param(truck_obj(), id="itself"),
        pytest.param(in_one_mesh(truck_obj()), id="in one mesh"),
        pytest.param(truck_obj().replace(b"o wheel", b"o tyre"), id="renamed"),
    ],
)
def test_a_truck_that_has_all_its_wheels_lacks_none(source: bytes) -> None:
    assert pieces(source, truck_obj()) == []
    assert pieces(truck_obj(), source) == []


@pytest.mark.parametrize("seed", range(5))
def test_noise_makes_no_part_missing(seed: int) -> None:
    rough = {
        name: truck_mesh(name).vertices
        + np.random.default_rng(seed).normal(scale=0.02, size=truck_mesh(name).vertices.shape)
        for name in ("body", *WHEELS)
    }

    assert pieces(truck_obj(instead=rough), truck_obj()) == []


def test_a_coarser_ball_beside_a_body_is_not_missing() -> None:
    def scene(subdivisions: int) -> bytes:
        ball, faces = shapes.sphere(subdivisions, 0.2)
        body = trimesh.creation.box((4, 1, 1))
        vertices = np.concatenate([body.vertices, ball + np.array([0, 0, 1.0])])
        return shapes.obj(vertices, np.concatenate([body.faces, faces + len(body.vertices)]))

    assert pieces(scene(1), scene(4)) == []


def test_of_many_missing_parts_ten_are_named() -> None:
    def row(count: int) -> bytes:
        boxes = [trimesh.creation.box((10, 10, 1))]
        for number in range(count):
            made = trimesh.creation.box((0.2, 0.2, 0.2))
            made.apply_translation([number * 0.5 - 3, 0, 2])
            boxes.append(made)
        joined = trimesh.util.concatenate(boxes)
        return shapes.obj(np.asarray(joined.vertices), np.asarray(joined.faces))

    found = pieces(row(0), row(13))

    assert len(found) == 11
    assert found[-1].words == "3 more parts: missing."


def test_different_shapes_do_not_lack_each_others_parts() -> None:
    balls = [trimesh.creation.icosphere(2, 0.3).apply_translation([x, 0, 3]) for x in (-1, 0, 1)]
    joined = trimesh.util.concatenate(balls)
    other = shapes.obj(np.asarray(joined.vertices), np.asarray(joined.faces))

    assert [each.code for each in pieces(truck_obj(), other)] == []


def opposed(source: bytes, reference: bytes) -> list[str | None]:
    report = measure(MeshFile("truck.obj", source), MeshFile("master.obj", reference), QUICK)
    return [each.where for each in report.warnings if each.code == "normals.opposed"]


def with_turned(name: str) -> bytes:
    """The truck with the faces of one body turned around."""
    turned, inside = [], False
    for line in truck_obj().decode().splitlines():
        inside = line == f"o {name}" if line.startswith("o ") else inside
        words = line.split()
        turned.append(" ".join([*words[:1], *words[:0:-1]]) if inside and words[0] == "f" else line)
    return "\n".join([*turned, ""]).encode()


def test_a_wheel_that_is_inside_out_is_named() -> None:
    assert opposed(with_turned("wheel_back_left"), truck_obj()) == ["wheel_back_left"]


def test_a_truck_that_is_not_turned_anywhere_draws_no_such_warning() -> None:
    rough = {name: truck_mesh(name).vertices + 0.002 for name in ("body", *WHEELS)}

    assert opposed(truck_obj(), truck_obj()) == []
    assert opposed(truck_obj(instead=rough), truck_obj()) == []


def test_faces_that_lie_back_to_back_say_nothing_of_their_side() -> None:
    both = truck_obj() + b"".join(
        b"f %s\n" % b" ".join(reversed(line.split()[1:]))
        for line in truck_obj().splitlines()
        if line.startswith(b"f ")
    )

    assert opposed(both, both) == []
