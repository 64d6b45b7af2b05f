"""Guard rounds mend what the schedule leaves folded, and hold the rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshcone.options import Options, SolverOptions, parse_options
from meshcone.program.certificate import residuals
from meshcone.program.cones import Orientation
from meshcone.program.correspondence import round_objective
from meshcone.program.effort import candidates
from meshcone.program.guards import Guard
from meshcone.program.prepared_reference import PreparedReference
from meshcone.program.round_solver import solve_round
from meshcone.program.rounds import refine_surface
from meshcone.program.source_structure import SourceStructure
from meshcone.program.surface_problem import SurfaceProblems
from meshcone.program.work import Allowance
from meshcone.quality.harm import HarmCheck
from meshcone.surface import Mesh, SurfaceTree
from tests.meshes import noisy, sheet, sphere, torus

QUIET = {"solver": {"certify": False}}


def guard_of(moving: Mesh, reference: Mesh) -> tuple[Guard, SourceStructure, PreparedReference]:
    prepared = PreparedReference.of(reference, len(moving.vertices), seed=1)
    structure = SourceStructure.of(moving, prepared, noise_scale=0.5)
    return Guard.of(moving, prepared, structure, 5_000_000), structure, prepared


def folded(mesh: Mesh, vertex: int) -> Mesh:
    """Carry a vertex within the surface past its neighbours, so that faces turn over."""
    positions = mesh.vertices.copy()
    neighbour = mesh.edges[(mesh.edges == vertex).any(axis=1)][0]
    other = neighbour[neighbour != vertex][0]
    positions[vertex] += 2.5 * (positions[other] - positions[vertex])
    return mesh.moved_to(positions)


def test_a_sound_mesh_has_nothing_amiss() -> None:
    guard, _, _ = guard_of(noisy(sphere(3), 0.005), sphere(3))

    assert not guard.amiss.any()


def test_faces_that_turn_over_or_cross_are_amiss_and_no_others_are() -> None:
    reference = sheet(12, 12)
    moving = folded(reference, 65)

    guard, _, _ = guard_of(moving, reference)

    # Faces lie in one plane: those of the vertex overlap what it was carried over.
    turned = np.flatnonzero(moving.face_normals[:, 2] < 0)
    assert len(turned)
    assert guard.amiss[turned].all()
    around = np.linalg.norm(moving.corners.mean(axis=1) - reference.vertices[65], axis=1)
    assert not guard.amiss[around > 5].any()


def test_where_half_of_the_faces_are_opposed_that_is_not_amiss() -> None:
    ball = sphere(2)
    inner = 0.9 * ball.vertices
    doubled = Mesh(
        np.concatenate([ball.vertices, inner]),
        np.concatenate([ball.faces, ball.faces[:, ::-1] + len(inner)]),
    )

    guard, _, _ = guard_of(doubled, ball)

    assert not guard.amiss.any()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000))
def test_the_half_space_is_the_area_along_its_direction_to_first_order(seed: int) -> None:
    mesh = noisy(torus(8, 6), 0.05, seed)
    generator = np.random.default_rng(seed)
    directions = mesh.face_normals + 0.3 * generator.normal(size=(len(mesh.faces), 3))
    cones = Orientation.at(mesh, directions, np.ones(len(mesh.faces), dtype=bool))
    along = np.einsum("ij,ij->i", mesh.doubled_area_vectors, directions)
    faces = np.flatnonzero(along > 0)
    step = 1e-6 * generator.normal(size=mesh.vertices.shape)

    def area_along(positions: np.ndarray) -> np.ndarray:
        a, b, c = np.moveaxis(positions[mesh.faces[faces]], 1, 0)
        return np.einsum("ij,ij->i", np.cross(b - a, c - a), directions[faces])

    found = cones.slack(mesh.vertices + step) - cones.slack(mesh.vertices)
    expected = area_along(mesh.vertices + step) - area_along(mesh.vertices)
    np.testing.assert_array_equal(cones.vertices, mesh.faces[faces])
    np.testing.assert_allclose(found[:, 0] * cones.sizes, expected, atol=1e-10)
    assert (cones.slack(mesh.vertices) > 0).all()


def test_a_held_face_may_lose_nine_tenths_of_its_area_and_no_more() -> None:
    mesh = sphere(1)
    cones = Orientation.at(mesh, mesh.face_normals, np.ones(len(mesh.faces), dtype=bool))

    room = cones.slack(mesh.vertices)[:, 0] * cones.sizes

    np.testing.assert_allclose(room, 0.9 * 2 * mesh.face_areas)


def test_one_with_little_area_along_its_direction_may_lose_half_of_that() -> None:
    mesh = sphere(1)
    across = np.cross(mesh.face_normals, mesh.corners[:, 1] - mesh.corners[:, 0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    directions = 0.1 * mesh.face_normals + np.sqrt(0.99) * across
    cones = Orientation.at(mesh, directions, np.ones(len(mesh.faces), dtype=bool))

    room = cones.slack(mesh.vertices)[:, 0] * cones.sizes

    np.testing.assert_allclose(room, 0.5 * 0.1 * 2 * mesh.face_areas)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_held_face_turns_over_where_the_pulls_would_turn_it(seed: int) -> None:
    reference = sphere(2)
    moving = noisy(reference, 0.25, seed)
    _, structure, prepared = guard_of(moving, reference)
    objective = round_objective(4, moving, prepared, structure, Options().surface)
    closest = SurfaceTree(reference).closest(moving.corners.mean(axis=1)).faces
    directions = reference.face_normals[closest]
    facing = np.einsum("ij,ij->i", moving.face_normals, directions) > 0
    held = Orientation.at(moving, directions, facing)

    free = solve_round(objective, [], moving.vertices, SolverOptions())
    found = solve_round(objective, [held], moving.vertices, SolverOptions())

    assert held.violation(free.positions).max() > 1e-3
    assert found.converged
    assert held.violation(found.positions).max() < 1e-6
    optimal = residuals(objective, [held], found.positions, found.multipliers)
    assert optimal.worst < 1e-5


def test_guard_rounds_follow_where_the_schedule_leaves_folds() -> None:
    source, reference, options = sphere(3), torus(32, 16, tube=0.35), parse_options(QUIET)
    mended = refine_surface(source, reference, options)
    folded_up = refine_surface(source, reference, options, guarded=False)

    harm = HarmCheck(source, reference, SurfaceTree(reference), 5_000_000)
    found, without = (harm.examine(answer.positions) for answer in (mended, folded_up))
    schedules = {c.name: len(c.options.fairness) for c in candidates(options)}
    assert mended.candidate == folded_up.candidate
    assert len(folded_up.rounds) == schedules[folded_up.candidate]
    assert len(mended.rounds) == schedules[mended.candidate] + 3
    assert found.amiss < 0.7 * without.amiss
    assert mended.final is not None
    assert "orientation" in {family.kind for family in mended.final.families}


def test_guard_rounds_end_before_they_cost_distance() -> None:
    source, reference = sphere(3), torus(32, 16, tube=0.5)
    options, without = (
        parse_options({**QUIET, "surface": {"guards": guards}}) for guards in (3, 0)
    )

    answer, folded_up = (refine_surface(source, reference, each) for each in (options, without))

    harm = HarmCheck(source, reference, SurfaceTree(reference), 5_000_000)
    found, before = (harm.examine(each.positions) for each in (answer, folded_up))
    assert found.amiss < before.amiss
    assert found.distances.mean <= 1.02 * before.distances.mean
    schedule = next(c for c in candidates(options) if c.name == answer.candidate)
    assert answer.final is not None
    assert answer.final.round_index == len(schedule.options.fairness)  # the first of them
    assert "orientation" not in {family.kind for family in answer.final.families}


@pytest.mark.parametrize("allowance", [Allowance(2, 10_000), Allowance(200, 5)])
def test_the_dual_method_ends_where_its_allowance_is_spent(allowance: Allowance) -> None:
    reference = sphere(2)
    moving = noisy(reference, 0.25, 1)
    _, structure, prepared = guard_of(moving, reference)
    objective = round_objective(4, moving, prepared, structure, Options().surface)
    held = Orientation.at(moving, moving.face_normals, np.ones(len(moving.faces), dtype=bool))

    found = solve_round(objective, [held], moving.vertices, SolverOptions(), allowance=allowance)

    assert not found.converged
    assert allowance.is_spent
    assert min(allowance.systems, allowance.products) >= 0


def test_without_guards_no_round_follows() -> None:
    options = parse_options({**QUIET, "surface": {"guards": 0}})

    answer = refine_surface(sphere(3), torus(32, 16, tube=0.4), options)

    # Places may still be given back to the input, in one round.
    schedules = {c.name: len(c.options.fairness) for c in candidates(options)}
    assert len(answer.rounds) <= schedules[answer.candidate] + 1
    assert answer.final is not None
    assert "orientation" not in {family.kind for family in answer.final.families}


def test_a_guard_round_is_written_again_from_where_it_starts() -> None:
    options = parse_options(QUIET)
    problems = SurfaceProblems(noisy(sphere(2), 0.3), sphere(2), options)
    problem = problems.problem(candidates(options)[0])
    before = noisy(sphere(2), 0.1, seed=5).vertices

    for index in range(problem.rounds, problem.guarded_rounds):
        (one, cones), (other, same) = (problem.program(index, before) for _ in range(2))
        np.testing.assert_array_equal(one.linear, other.linear)
        np.testing.assert_array_equal(one.fairness.weights, other.fairness.weights)
        assert [len(family) for family in cones] == [len(family) for family in same]
    assert len(cones) == 2


def test_each_guard_round_smooths_harder() -> None:
    options = parse_options(QUIET)
    problems = SurfaceProblems(noisy(sphere(2), 0.3), sphere(2), options)
    problem = problems.problem(candidates(options)[0])
    before = noisy(sphere(2), 0.1, seed=5).vertices

    largest = [
        problem.program(index, before)[0].fairness.weights.max()
        for index in range(problem.rounds - 1, problem.guarded_rounds)
    ]
    assert largest == sorted(largest)
    assert largest[-1] > 100 * largest[0]
