"""Vertices within an edge of another border follow it, and the rest is solved for."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.options import Options
from meshcone.program.effort import candidates
from meshcone.program.relaxation import solve_relaxation
from meshcone.program.seams import Seams
from meshcone.program.surface_problem import SurfaceProblems
from meshcone.program.tied import TiedObjective
from meshcone.program.ties import Ties
from meshcone.quality.contacts import Contacts
from meshcone.surface import Mesh
from tests.meshes import joined_halves, sheet

FAST = Options(effort="fast")
SHEET = sheet(9, 5)
REFERENCE = SHEET.moved_to(SHEET.vertices / [4, 4, 1] + [0, 0, 0.1])


def tied(mesh: Mesh) -> Ties:
    ties = Seams.of(mesh).ties
    assert ties is not None
    return ties


def following(edges: dict[int, tuple[int, int]], shares: dict[int, float], count: int) -> Ties:
    """Some of so many vertices on a line, each of which follows a place on an edge."""
    vertices, ends = np.array(list(edges)), np.array(list(edges.values()))
    places = np.array([shares[vertex] for vertex in edges])
    none = np.zeros(len(vertices))
    contacts = Contacts(vertices, ends, places, none, np.ones(len(vertices), dtype=bool), none)
    positions = np.zeros((count, 3))
    positions[:, 0] = np.arange(count)
    made = Ties.of(positions, contacts)
    assert made is not None
    return made


@pytest.fixture
def objective() -> TiedObjective:
    mesh = joined_halves(4, 6)
    [setting] = candidates(FAST)
    problem = SurfaceProblems(mesh, REFERENCE, FAST, ties=tied(mesh)).problem(setting)
    found, families = problem.program(3, mesh.vertices)
    assert isinstance(found, TiedObjective)
    assert families[-1] is found.ties.cones
    return found


def test_a_seam_that_is_divided_alike_ties_nothing() -> None:
    assert Seams.of(joined_halves(4, 4)).ties is None


def test_a_vertex_moves_by_what_its_place_on_the_edge_moves() -> None:
    mesh = joined_halves(2, 4)
    moved = mesh.vertices.copy()
    top, bottom = (np.flatnonzero((mesh.vertices[:, :2] == [1, y]).all(axis=1)) for y in (0, 0.5))
    between = np.flatnonzero((mesh.vertices[:, :2] == [1, 0.25]).all(axis=1))
    moved[top] += [0, 0, 0.2]
    moved[bottom] += [0.1, 0, 0]

    settled = tied(mesh).settled(moved)

    np.testing.assert_allclose(settled[between], mesh.vertices[between] + [0.05, 0, 0.1])
    others = np.setdiff1d(np.arange(len(moved)), tied(mesh).cones.vertices[:, 0])
    np.testing.assert_array_equal(settled[others], moved[others])


@pytest.mark.parametrize("cells", [(4, 5), (4, 6), (7, 23)])
def test_where_each_side_divides_the_other_s_edges_the_seam_stays_one_line(
    cells: tuple[int, int],
) -> None:
    mesh = joined_halves(*cells)
    ties = tied(mesh)
    moved = mesh.vertices + np.random.default_rng(1).normal(size=mesh.vertices.shape)

    settled = ties.settled(moved)

    np.testing.assert_allclose(ties.cones.slack(settled), 0, atol=1e-13)


def test_what_follows_others_that_follow_moves_by_a_mean_of_the_free() -> None:
    ties = following({1: (0, 2), 2: (1, 3)}, {1: 0.5, 2: 0.5}, 4)

    np.testing.assert_allclose(ties.weights[[1]].toarray(), [[2 / 3, 0, 0, 1 / 3]])


def test_a_chain_of_ties_is_stated_as_ties_to_its_ends() -> None:
    cones = following({1: (0, 2), 2: (1, 3)}, {1: 0.5, 2: 0.5}, 4).cones

    np.testing.assert_array_equal(cones.vertices, [[1, 0, 3], [2, 0, 3]])
    np.testing.assert_allclose(cones.shares, [1 / 3, 2 / 3])


def test_what_follows_three_is_tied_to_its_edge() -> None:
    cones = following({1: (0, 2), 2: (3, 4)}, {1: 0.5, 2: 0.5}, 5).cones

    np.testing.assert_array_equal(cones.vertices, [[1, 0, 2], [2, 3, 4]])


def test_where_all_around_a_seam_follow_each_other_one_is_left_free() -> None:
    ties = following({0: (1, 2), 1: (2, 0), 2: (0, 1)}, {0: 0.5, 1: 0.3, 2: 0.8}, 3)

    np.testing.assert_allclose(ties.weights.toarray(), [[1, 0, 0]] * 3, atol=1e-12)


def test_what_a_held_vertex_follows_is_held_and_so_is_what_else_follows_that() -> None:
    ties = following({1: (0, 3), 2: (0, 3)}, {1: 0.3, 2: 0.7}, 5)

    np.testing.assert_array_equal(
        ties.closed(np.array([False, True, False, False, False])), [True] * 4 + [False]
    )
    np.testing.assert_array_equal(
        ties.closed(np.array([True, False, False, False, False])), [True] + [False] * 4
    )


def test_the_optimum_is_that_of_the_free_vertices_with_the_others_in_place(
    objective: TiedObjective,
) -> None:
    ties, whole = objective.ties, objective.whole
    free = np.flatnonzero(~ties.tied)
    weights = np.kron(ties.weights.toarray()[:, free], np.eye(3))
    P, offsets = whole.matrix().toarray(), ties.offsets.ravel()
    reduced = np.linalg.solve(weights.T @ P @ weights, -weights.T @ (whole.linear + P @ offsets))

    found = solve_relaxation(objective, ties.rest.ravel())

    expected = weights @ reduced + offsets
    np.testing.assert_allclose(found, expected, atol=1e-6)
    exact = np.linalg.solve(objective.matrix().toarray(), -objective.linear)
    np.testing.assert_allclose(exact, expected, atol=1e-11)


def test_where_all_follow_it_has_the_value_of_what_it_is_made_of(objective: TiedObjective) -> None:
    noise = np.random.default_rng(2).normal(size=objective.ties.rest.shape)
    x = objective.ties.settled(objective.ties.rest + noise).ravel()

    values = [f.constant + f.linear @ x + x @ f.apply(x) / 2 for f in (objective, objective.whole)]

    assert values[0] == pytest.approx(values[1], rel=1e-12)


def test_products_are_those_of_the_matrix(objective: TiedObjective) -> None:
    matrix = objective.matrix().toarray()
    x = np.random.default_rng(1).normal(size=len(matrix))

    np.testing.assert_allclose(matrix, matrix.T, atol=1e-12)
    np.testing.assert_allclose(objective.apply(x), matrix @ x, atol=1e-9)
    np.testing.assert_allclose(objective.product()(x), matrix @ x, atol=1e-9)
