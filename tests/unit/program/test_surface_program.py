"""The surface program: its objective written three ways, and what its rounds achieve."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.options import Options, SurfaceOptions, parse_options
from meshcone.program.cones import EdgeCaps
from meshcone.program.conic import assemble, everything
from meshcone.program.correspondence import round_objective
from meshcone.program.prepared_reference import PreparedReference
from meshcone.program.relaxation import solve_relaxation
from meshcone.program.rounds import refine_surface
from meshcone.program.source_structure import SourceStructure
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import row_dot
from tests.meshes import cylinder, noisy, sheet, sphere, torus

PIPE = Mesh(cylinder(12, 9, 0.5, 1.5).vertices, cylinder(12, 9, 0.5, 1.5).faces)
# The reference of an open source lacks its upper third.
SHORTER = Mesh(PIPE.vertices, PIPE.faces[PIPE.corners[:, :, 2].max(axis=1) < 0.3])


@pytest.fixture(
    params=[
        (0, sphere(2), sphere(3)),
        (1, sphere(2), sphere(3)),
        (1, PIPE, SHORTER),
        (3, PIPE, SHORTER),
    ],
    ids=["first round", "second round", "open, longer than the reference", "with face pulls"],
)
def objective(request: pytest.FixtureRequest) -> SurfaceObjective:
    index, shape, reference = request.param
    source = noisy(shape, 0.02)
    prepared = PreparedReference.of(reference, len(source.vertices), seed=1)
    structure = SourceStructure.of(source, prepared, noise_scale=0.5)
    return round_objective(index, source, prepared, structure, SurfaceOptions())


def written_out(objective: SurfaceObjective, positions: np.ndarray) -> float:
    """The formula of the module's docstring, term by term."""
    forward = objective.forward
    off = positions - forward.targets
    total = np.sum(
        forward.weights
        * (row_dot(forward.normals, off) ** 2 + forward.tangential * np.sum(off**2, axis=1))
    )
    if objective.backward is not None and objective.carried is not None:
        backward, carried = objective.backward, objective.carried
        points = np.einsum("ij,ijk->ik", carried.weights, positions[carried.corners])
        off = points - backward.targets
        total += np.sum(
            backward.weights
            * (row_dot(backward.normals, off) ** 2 + backward.tangential * np.sum(off**2, axis=1))
        )
    total += objective.proximity * np.sum((positions - objective.previous) ** 2)
    fairness = objective.fairness
    bent = fairness.laplacian @ positions - fairness.rest
    total += np.sum(fairness.weights[:, None] * bent**2)
    across = row_dot(fairness.normals, bent)
    total += np.sum(fairness.outline * (np.sum(bent**2, axis=1) - across**2))
    return float(total)


def test_the_quadratic_form_is_the_formula(objective: SurfaceObjective):
    x = np.random.default_rng(5).normal(size=objective.linear.shape)
    positions = x.reshape(-1, 3)

    value = 0.5 * x @ objective.apply(x) + objective.linear @ x + objective.constant

    assert value == pytest.approx(written_out(objective, positions), rel=1e-12)


def test_the_matrix_is_the_operator(objective: SurfaceObjective):
    x = np.random.default_rng(0).normal(size=objective.linear.shape)
    P = objective.matrix()

    np.testing.assert_allclose(P @ x, objective.apply(x), atol=1e-12)
    np.testing.assert_allclose(objective.product()(x), objective.apply(x), atol=1e-12)
    blocks = objective.diagonal_blocks().full()
    on_diagonal = P.toarray()[
        np.arange(len(x)).reshape(-1, 3, 1), np.arange(len(x)).reshape(-1, 1, 3)
    ]
    np.testing.assert_allclose(blocks, on_diagonal, atol=1e-12)
    assert abs(P - P.T).max() < 1e-14


def test_the_relaxation_has_no_gradient_left(objective: SurfaceObjective):
    x = solve_relaxation(objective, objective.previous.ravel())

    gradient = objective.apply(x) + objective.linear

    assert np.linalg.norm(gradient) < 1e-6 * np.linalg.norm(objective.linear)


def test_samples_under_a_part_that_the_reference_lacks_do_not_pull_at_its_foot():
    plate = sheet(21, 21)
    plate = plate.moved_to(plate.vertices / 10 - [1, 1, 0])
    on_top = (np.abs(plate.vertices[:, :2]) < 0.15).all(axis=1)
    source = noisy(plate.moved_to(plate.vertices + 0.8 * on_top[:, None] * [0, 0, 1]), 0.004)
    prepared = PreparedReference.of(plate, len(source.vertices), seed=1)
    structure = SourceStructure.of(source, prepared, noise_scale=0.5)

    objective = round_objective(3, source, prepared, structure, SurfaceOptions(faces=0.0))

    assert objective.backward is not None
    targets = objective.backward.targets
    assert not (np.abs(targets[:, :2]) < 0.12).all(axis=1).any()
    assert (np.abs(targets[:, :2]) > 0.3).any(axis=1).sum() > 100


def test_samples_of_what_the_reference_lacks_pull_at_nothing():
    source = noisy(PIPE, 0.02)
    prepared = PreparedReference.of(SHORTER, len(source.vertices), seed=1)
    structure = SourceStructure.of(source, prepared, noise_scale=0.5)

    objective = round_objective(3, source, prepared, structure, SurfaceOptions())

    assert objective.backward is not None
    assert objective.carried is not None
    corners = source.vertices[objective.carried.corners]
    heights = np.einsum("ij,ij->i", objective.carried.weights, corners[:, :, 2])
    assert (heights > 0.5).any()
    assert not objective.backward.weights[heights > 0.5].any()


def test_the_input_satisfies_the_default_edge_caps():
    source = noisy(torus(), 0.05)

    caps = EdgeCaps.relative(source, 2.0)

    assert caps.violation(source.vertices).max() == 0


def test_cone_rows_are_the_slack():
    source = noisy(sphere(2), 0.05)
    caps = EdgeCaps.relative(source, 1.5)
    A, b = caps.rows(np.array([3, 10, 200]), len(source.vertices))

    np.testing.assert_allclose(
        (b - A @ source.vertices.ravel()).reshape(-1, 4), caps.slack(source.vertices)[[3, 10, 200]]
    )


def mean_distance(mesh: Mesh, reference: Mesh) -> float:
    return float(SurfaceTree(reference).closest(mesh.vertices).distances.mean())


@pytest.mark.parametrize("shape", [sphere(3), torus()], ids=["sphere", "torus"])
def test_noise_of_two_percent_shrinks_to_a_tenth(shape: Mesh):
    source = noisy(shape, 0.02)

    answer = refine_surface(source, shape, Options())

    refined = source.moved_to(answer.positions)
    assert mean_distance(refined, shape) < 0.1 * mean_distance(source, shape)
    assert answer.rounds[-1].info is not None
    assert answer.rounds[-1].info.solved


def distance_both_ways(mesh: Mesh, reference: Mesh) -> float:
    """Mean distance between the surfaces: with fewer vertices than the reference, the best
    mesh has its vertices outside of it and its faces inside."""
    one, other = (sample_surface(surface, 4096, seed=0).points for surface in (mesh, reference))
    there = SurfaceTree(reference).closest(one).distances.mean()
    back = SurfaceTree(mesh).closest(other).distances.mean()
    return float(there + back) / 2


def test_another_tessellation_of_the_reference_serves_as_well():
    source, reference = noisy(torus(), 0.02), torus(rings=77, sides=40)

    answer = refine_surface(source, reference, Options())

    refined = source.moved_to(answer.positions)
    assert distance_both_ways(refined, reference) < 0.15 * distance_both_ways(source, reference)


def test_an_inside_out_reference_is_recognised():
    source, reference = noisy(torus(), 0.02), torus()
    flipped = Mesh(reference.vertices, reference.faces[:, ::-1])

    answer = refine_surface(source, flipped, Options())

    refined = source.moved_to(answer.positions)
    assert mean_distance(refined, reference) < 0.1 * mean_distance(source, reference)


def test_tight_edge_caps_hold_in_the_answer():
    source, reference = sphere(3), sphere(3)
    grown = reference.moved_to(reference.vertices * 1.3)
    options = parse_options({"effort": "fast", "surface": {"edge_cap": 1.0, "fairness": [1.0]}})

    answer = refine_surface(source, grown, options)

    assert answer.rounds[0].active_cones["edge_cap"] > 0
    assert EdgeCaps.relative(source, 1.0).violation(answer.positions).max() < 1e-6


def test_the_same_seed_gives_the_same_answer():
    source, reference = noisy(sphere(2), 0.02), sphere(3)

    first, second = (refine_surface(source, reference, Options(seed=7)) for _ in range(2))

    np.testing.assert_array_equal(first.positions, second.positions)


def test_every_round_is_announced():
    announced: list[tuple[int, int]] = []
    options = parse_options({"effort": "fast", "surface": {"fairness": [1.0, 0.3]}})

    refine_surface(noisy(sphere(2), 0.02), sphere(2), options, lambda *done: announced.append(done))

    assert announced == [(1, 2), (2, 2)]


def test_a_program_lists_its_cones_for_scs(objective: SurfaceObjective):
    caps = EdgeCaps(np.array([[0, 1], [1, 2], [2, 3]]), np.ones(3))

    program = assemble(objective, everything([caps]))

    assert program.cones == {"q": [4] * len(caps)}
    assert program.A.shape == (4 * len(caps), len(objective.linear))
