"""Vertices that stay, and places that are given back to the input."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.options import parse_options
from meshcone.program.attempt import Attempt, Countdown
from meshcone.program.certificate import residuals
from meshcone.program.effort import candidates
from meshcone.program.held import HeldObjective
from meshcone.program.remedies import given_back
from meshcone.program.rounds import refine_surface
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.program.surface_problem import SurfaceProblems
from meshcone.quality.harm import HarmCheck
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Bools, Floats
from tests.meshes import noisy, sphere, torus

QUIET = {"solver": {"certify": False}}
FAST = parse_options({**QUIET, "effort": "fast"})


def spiked(mesh: Mesh, share: float, seed: int) -> tuple[Mesh, Bools]:
    """Throw a share of the vertices off by a fifth of the radius; say which."""
    draw = np.random.default_rng(seed)
    moved = draw.random(len(mesh.vertices)) < share
    away = draw.normal(size=mesh.vertices.shape)
    away *= 0.2 / np.linalg.norm(away, axis=1, keepdims=True)
    return mesh.moved_to(mesh.vertices + np.where(moved[:, None], away, 0)), moved


def completed(source: Mesh, reference: Mesh) -> tuple[SurfaceProblems, Attempt]:
    [setting] = candidates(FAST)
    problems = SurfaceProblems(source, reference, FAST)
    attempt = Attempt(setting.name, problems.problem(setting), FAST.solver)
    attempt.complete(Countdown(None, 5))
    return problems, attempt


def torn(positions: Floats, vertex: int) -> Floats:
    answer = positions.copy()
    answer[vertex] *= 1.4
    return answer


@pytest.fixture
def objective() -> HeldObjective:
    source, reference = noisy(sphere(2), 0.02), sphere(3)
    [setting] = candidates(FAST)
    problem = SurfaceProblems(source, reference, FAST).problem(setting)
    whole, _ = problem.program(4, source.vertices)
    assert isinstance(whole, SurfaceObjective)
    held = np.random.default_rng(5).random(len(source.vertices)) < 0.3
    return HeldObjective(whole, held, source.vertices)


def test_the_optimum_over_the_others_is_that_of_the_whole_with_the_held_put_in(
    objective: HeldObjective,
) -> None:
    whole, rows = objective.whole.matrix().toarray(), np.repeat(objective.held, 3)
    places = objective.places.ravel()
    rest = -objective.whole.linear[~rows] - whole[np.ix_(~rows, rows)] @ places[rows]
    expected = places.copy()
    expected[~rows] = np.linalg.solve(whole[np.ix_(~rows, ~rows)], rest)

    found = np.linalg.solve(objective.matrix().toarray(), -objective.linear)

    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_with_the_held_in_their_places_both_have_the_same_value(objective: HeldObjective) -> None:
    x = np.random.default_rng(2).normal(size=objective.places.shape)
    x = np.where(objective.held[:, None], objective.places, x).ravel()

    values = [f.constant + f.linear @ x + x @ f.apply(x) / 2 for f in (objective, objective.whole)]

    assert values[0] == pytest.approx(values[1], rel=1e-12)


def test_products_and_blocks_are_those_of_the_matrix(objective: HeldObjective) -> None:
    matrix = objective.matrix().toarray()
    x = np.random.default_rng(1).normal(size=len(matrix))

    np.testing.assert_allclose(objective.apply(x), matrix @ x, atol=1e-9)
    np.testing.assert_allclose(objective.product()(x), matrix @ x, atol=1e-9)
    blocks = objective.diagonal_blocks().full()
    for vertex in range(len(blocks)):
        at = slice(3 * vertex, 3 * vertex + 3)
        np.testing.assert_allclose(blocks[vertex], matrix[at, at], atol=1e-9)


@pytest.mark.parametrize("seed", [1, 2])
def test_of_a_mesh_that_is_right_but_for_spikes_only_these_move(seed: int) -> None:
    reference = torus(32, 16)
    source, moved = spiked(reference, 0.03, seed)

    answer = refine_surface(source, reference, parse_options(QUIET))

    assert answer.candidate == "mending"
    np.testing.assert_array_equal(answer.positions[~moved], reference.vertices[~moved])
    was, now = (
        np.linalg.norm(positions[moved] - reference.vertices[moved], axis=1).mean()
        for positions in (source.vertices, answer.positions)
    )
    assert now < 0.15 * was


def test_a_mesh_that_is_off_everywhere_is_not_mended() -> None:
    announced: list[tuple[int, int]] = []
    options = parse_options(QUIET)

    refine_surface(noisy(sphere(2), 0.01), sphere(3), options, lambda *done: announced.append(done))

    usual = [len(c.options.fairness) for c in candidates(options) if c.is_always_tried]
    assert announced[-1][1] == sum(usual)


@pytest.mark.parametrize("vertex", [17, 100])
def test_what_speaks_against_an_answer_is_found_where_it_is(vertex: int) -> None:
    source, reference = noisy(sphere(3), 0.02), sphere(3)
    harm = HarmCheck(source, reference, SurfaceTree(reference), 5_000_000)

    places = harm.places(harm.examine(torn(reference.vertices, vertex)))

    near = np.linalg.norm(reference.vertices - reference.vertices[vertex], axis=1) < 0.4
    assert places[vertex]
    assert not (places & ~near).any()


def test_where_only_the_largest_distance_harms_only_what_is_so_far_away_does() -> None:
    reference = sphere(3)
    upper = reference.vertices[:, 2] > 0
    source = reference.moved_to(reference.vertices * np.where(upper, 1.2, 1)[:, None])
    harm = HarmCheck(source, reference, SurfaceTree(reference), 5_000_000)
    below = np.flatnonzero(reference.vertices[:, 2] < -0.9)[0]

    # What was right is off by a little: the mean falls all the same.
    places = harm.places(harm.examine(torn(1.04 * reference.vertices, below)))

    near = np.linalg.norm(reference.vertices - reference.vertices[below], axis=1) < 0.4
    assert places[below]
    assert not (places & ~near).any()


def test_a_place_that_harms_is_given_back_and_the_rest_is_kept() -> None:
    source, reference = noisy(sphere(3), 0.02), sphere(3)
    problems, attempt = completed(source, reference)
    harm = HarmCheck(source, reference, problems.prepared.tree, 5_000_000)
    attempt.positions = torn(attempt.positions, 17)
    found = harm.examine(attempt.positions)
    assert found.objections

    mended = given_back(attempt, harm, found)

    assert mended is not None
    again, after = mended
    assert not after.objections
    np.testing.assert_array_equal(again.positions[17], source.vertices[17])
    assert after.distances.mean < 0.3 * harm.input.distances.mean


def test_an_answer_that_harms_in_most_places_is_not_given_back() -> None:
    source, reference = noisy(sphere(3), 0.02), sphere(3)
    problems, attempt = completed(source, reference)
    harm = HarmCheck(source, reference, problems.prepared.tree, 5_000_000)
    attempt.positions = 1.1 * attempt.positions

    assert given_back(attempt, harm, harm.examine(attempt.positions)) is None


def test_what_is_given_back_is_an_optimum_and_is_written_again_from_where_it_starts() -> None:
    source, reference = noisy(sphere(2), 0.02), sphere(3)
    problems, attempt = completed(source, reference)
    held = np.linalg.norm(source.vertices - [0, 0, 1], axis=1) < 0.5

    again = attempt.holding(held)
    finish = again.complete(Countdown(None, 0))

    np.testing.assert_array_equal(finish.solution.positions[held], source.vertices[held])
    [setting] = candidates(FAST)
    program = problems.problem(setting).program(finish.round_index, finish.before)
    solution = finish.solution
    found = residuals(*program, solution.positions, solution.multipliers)
    assert found.worst < 1e-6


def test_a_mesh_of_two_sided_faces_is_refined_as_one_of_single_faces() -> None:
    source, reference = noisy(sphere(2), 0.02), sphere(3)
    doubled = [
        Mesh(mesh.vertices, np.concatenate([mesh.faces, mesh.faces[:, ::-1]]))
        for mesh in (source, reference)
    ]

    answer, expected = (refine_surface(*pair, FAST) for pair in (doubled, (source, reference)))

    np.testing.assert_array_equal(answer.positions, expected.positions)
