"""The paper's program: its sizes, its closed form, and both of its forms against each other."""

from __future__ import annotations

import cvxpy as cp
import numpy as np
import pytest

from meshcone.options import Options, SolverOptions, parse_options
from meshcone.program.centroid import CentroidObjective, choose_anchor
from meshcone.program.cones import EdgeCaps
from meshcone.program.conic import assemble, everything
from meshcone.program.model import centroid_model, compiled_sizes
from meshcone.program.paper import refine_centroid
from meshcone.program.scs_solver import solve
from meshcone.surface import Mesh
from tests.meshes import noisy, sheet, sphere

TIGHT = SolverOptions(tolerance=1e-9, max_iterations=100_000)


def perforated_sheet() -> Mesh:
    """3,403 vertices and 9,542 edges: a sheet of 9,962 with 420 separate cells cut out.

    A cell whose four neighbours stay loses its diagonal only.
    """
    rows, columns = 83, 41
    full = sheet(rows, columns)
    i, j = np.meshgrid(np.arange(1, 81, 2), np.arange(1, 39, 2), indexing="ij")
    cut = (i * (columns - 1) + j).ravel()[:420]
    cells = (rows - 1) * (columns - 1)
    return Mesh(full.vertices, np.delete(full.faces, np.concatenate([cut, cut + cells]), axis=0))


def test_the_model_compiles_to_the_papers_table():
    mesh = perforated_sheet()
    objective = CentroidObjective(np.zeros(3), mesh.vertices, 0.01)
    problem, _ = centroid_model(objective, EdgeCaps.uniform(mesh, 0.5))

    sizes = compiled_sizes(problem)

    assert (len(mesh.vertices), len(mesh.edges)) == (3403, 9542)
    assert sizes.variables == 40_169
    assert sizes.constraints == 68_128
    assert sizes.zero == 20_418
    assert sizes.linear == 9_542
    assert sizes.second_order == 38_168
    assert sizes.cones == {"edge_cap": 9_542}
    assert sizes.nnz_A == 117_172
    assert sizes.nnz_P == 20_418


@pytest.fixture
def objective() -> CentroidObjective:
    return CentroidObjective(np.array([0.1, -0.2, 0.05]), noisy(sphere(2), 0.02).vertices, 0.01)


def test_all_forms_agree_where_no_cone_binds(objective: CentroidObjective):
    caps = EdgeCaps.uniform(sphere(2), 0.5)
    reduced = solve(assemble(objective, everything([caps])), TIGHT).solution.x.reshape(-1, 3)
    problem, X = centroid_model(objective, caps)
    problem.solve(solver=cp.SCS, eps_abs=1e-9, eps_rel=1e-9, max_iters=100_000)

    closed_form = objective.unconstrained_optimum()

    np.testing.assert_allclose(reduced, closed_form, atol=1e-6)
    np.testing.assert_allclose(X.value, closed_form, atol=1e-6)


@pytest.mark.parametrize(
    ("solver", "settings"),
    [("SCS", {"eps_abs": 1e-8, "eps_rel": 1e-8, "max_iters": 100_000}), ("CLARABEL", {})],
)
def test_reduced_form_and_model_agree_where_cones_bind(
    objective: CentroidObjective, solver: str, settings: dict[str, float]
):
    mesh = sphere(2)
    shrunk = mesh.moved_to(objective.unconstrained_optimum())
    caps = EdgeCaps.uniform(mesh, 0.7 * shrunk.edge_lengths.max())
    run = solve(assemble(objective, everything([caps])), TIGHT)
    problem, X = centroid_model(objective, caps)
    problem.solve(solver=solver, **settings)

    reduced = run.solution.x.reshape(-1, 3)

    assert caps.violation(reduced).max() < 1e-6
    np.testing.assert_allclose(reduced, X.value, atol=1e-4)


def test_the_shrink_is_undone_exactly(objective: CentroidObjective):
    restored = objective.undo_shrink(objective.unconstrained_optimum())

    np.testing.assert_allclose(restored, objective.anchor, atol=1e-12)


def test_the_objective_constant_makes_the_optimum_a_sum_of_squares(objective: CentroidObjective):
    x = noisy(sphere(2), 0.1, seed=3).vertices
    direct = np.sum((x - objective.centroid) ** 2) + 0.01 * np.sum((x - objective.anchor) ** 2)
    flat = x.ravel()

    value = 0.5 * flat @ objective.apply(flat) + objective.linear @ flat + objective.constant

    assert value == pytest.approx(direct)


def test_equal_faces_anchor_the_program_at_the_reference():
    reference = sphere(2)

    anchor, copied = choose_anchor(noisy(reference, 0.02), reference)

    assert copied
    assert anchor is reference.vertices


def test_equal_counts_in_another_vertex_order_do_not():
    reference = sphere(2)
    order = np.random.default_rng(0).permutation(len(reference.vertices))
    shuffled = Mesh(reference.vertices[np.argsort(order)], order[reference.faces])

    _, copied = choose_anchor(noisy(reference, 0.02), shuffled)

    assert not copied


@pytest.mark.parametrize("form", ["reduced", "cvxpy"])
def test_both_forms_return_the_reference_and_say_that_they_copied_it(form: str):
    reference = sphere(2)
    options = parse_options({"formulation": "centroid", "centroid": {"form": form}})

    answer = refine_centroid(noisy(reference, 0.02), reference, options)

    assert answer.copied_reference
    assert answer.rounds[0].info is not None
    assert answer.rounds[0].info.solved
    assert answer.rounds[0].active_cones == {"edge_cap": 0}
    np.testing.assert_allclose(answer.positions, reference.vertices, atol=1e-5)


def test_the_solver_history_is_kept_for_every_iteration():
    reference = sphere(2)

    answer = refine_centroid(noisy(reference, 0.02), reference, Options(formulation="centroid"))

    record = answer.rounds[0]
    assert record.info is not None
    assert record.history["iter"] == list(range(record.info.iterations + 1))
    assert set(record.history) >= {"res_pri", "res_dual", "gap"}
