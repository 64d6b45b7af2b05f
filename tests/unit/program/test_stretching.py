"""A mesh far from its reference is stretched over it before the first round."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.stats import spearmanr

from meshcone.options import parse_options
from meshcone.program.effort import candidates
from meshcone.program.rounds import refine_surface
from meshcone.program.stretching import stretched
from meshcone.program.surface_problem import SurfaceProblems
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from tests.meshes import noisy, sphere

QUIET = {"solver": {"certify": False}}


def stick() -> Mesh:
    """A closed box four times as long as it is wide; its farthest corner is at 1."""
    made = trimesh.creation.box((0.94, 0.24, 0.24))
    for _ in range(4):
        made = made.subdivide()
    return Mesh(2 * made.vertices, made.faces)


def start_over(source: Mesh, reference: Mesh) -> np.ndarray:
    problems = SurfaceProblems(source, reference, parse_options({}))
    [setting] = [c for c in candidates(problems.options) if c.stretched]
    problem = problems.problem(setting)
    return stretched(source, problem.reference, problem.structure)


def distances(mesh: Mesh, reference: Mesh) -> tuple[float, float]:
    there, back = (sample_surface(m, 4096, seed=91).points for m in (mesh, reference))
    return (
        float(SurfaceTree(reference).closest(there).distances.mean()),
        float(SurfaceTree(mesh).closest(back).distances.mean()),
    )


def test_a_ball_is_stretched_to_both_ends_of_a_stick() -> None:
    ball, reference = sphere(3), stick()

    start = ball.moved_to(start_over(ball, reference))

    for before, after in zip(distances(ball, reference), distances(start, reference), strict=True):
        assert after < 0.25 * before
    np.testing.assert_allclose(np.ptp(start.vertices, axis=0), [1.88, 0.48, 0.48], atol=0.2)


def test_a_start_faces_the_way_its_reference_does() -> None:
    ball, reference = sphere(3), stick()

    start = ball.moved_to(start_over(ball, reference))

    closest = SurfaceTree(reference).closest(start.corners.mean(axis=1)).faces
    facing = np.einsum("ij,ij->i", start.face_normals, reference.face_normals[closest])
    assert np.mean(facing > 0) > 0.95


def test_a_source_inside_out_stays_so() -> None:
    ball, reference = sphere(3), stick()
    inside_out = Mesh(ball.vertices, ball.faces[:, ::-1])

    np.testing.assert_allclose(
        start_over(inside_out, reference), start_over(ball, reference), atol=1e-3
    )


def test_the_same_source_is_stretched_to_the_same_bytes() -> None:
    ball, reference = sphere(2), stick()

    assert start_over(ball, reference).tobytes() == start_over(ball, reference).tobytes()


def test_what_lay_in_order_along_a_stick_still_does() -> None:
    ball, reference = sphere(3), stick()

    start = start_over(ball, reference)

    # Of a mass on a line the cheapest matching crosses nothing.
    assert spearmanr(ball.vertices[:, 0], start[:, 0]).statistic > 0.99


@pytest.mark.parametrize("seed", [1, 2])
def test_a_far_start_wins_the_race_and_ends_close(seed: int) -> None:
    source, reference = noisy(sphere(3), 0.002, seed), stick()

    answer = refine_surface(source, reference, parse_options(QUIET))

    assert answer.candidate == "stretching"
    for found in distances(source.moved_to(answer.positions), reference):
        assert found < 1e-3


def test_a_start_that_is_near_is_not_stretched() -> None:
    announced: list[tuple[int, int]] = []
    options = parse_options(QUIET)

    refine_surface(noisy(stick(), 0.02), stick(), options, lambda *done: announced.append(done))

    rounds = {c.name: len(c.options.fairness) for c in candidates(options)}
    assert announced[-1][1] == rounds["smoothing"] + rounds["pulling"]


def test_where_cones_are_asked_for_a_far_start_is_not_stretched() -> None:
    asked = {**QUIET, "cones": {"max_displacement": {"relative": 2.0}}}

    answer = refine_surface(sphere(2), stick(), parse_options(asked), guarded=False)

    assert answer.candidate != "stretching"
