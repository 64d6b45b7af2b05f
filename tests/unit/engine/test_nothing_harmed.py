"""What comes back is never worse than what was sent."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, row_lengths
from meshcone.verbs.refine import Refinement, refine
from tests import shapes
from tests.meshes import cylinder, noisy, sheet, sphere, torus


def file(name: str, mesh: Mesh) -> MeshFile:
    return MeshFile(name, shapes.obj(mesh.vertices, mesh.faces))


def refined(source: Mesh, reference: Mesh, **options: object) -> Refinement:
    return refine(file("s.obj", source), file("r.obj", reference), parse_options(options))


@pytest.mark.parametrize("effort", ["fast", "best"])
@pytest.mark.parametrize("factor", [1000.0, 0.001])
def test_other_units_come_back_as_they_were(factor: float, effort: str) -> None:
    source = noisy(sphere(3), 0.01)
    source = source.moved_to(factor * source.vertices)

    answer = refined(source, sphere(3), effort=effort)

    assert answer.report.outcome == "misaligned"
    assert answer.data == file("s.obj", source).data
    assert answer.report.certificate is None
    [told] = [told for told in answer.report.warnings if told.code == "pose.misfit"]
    assert "With align=similarity" in told.words


def test_other_units_are_refined_where_aligning_is_asked_for() -> None:
    source = noisy(sphere(3), 0.01)

    answer = refined(source.moved_to(1000 * source.vertices), sphere(3), align="similarity")

    assert answer.report.outcome == "improved"


def test_another_place_comes_back_as_it_was() -> None:
    source = noisy(torus(), 0.01)

    answer = refined(source.moved_to(source.vertices + np.array([40, 0, 0])), torus())

    assert answer.report.outcome == "misaligned"
    assert answer.report.displacement.max == 0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_answer_worse_somewhere_gives_way_to_the_input(seed: int) -> None:
    generator = np.random.default_rng(seed)
    reference = Mesh(generator.normal(size=(3, 3)), np.array([[0, 1, 2]]))
    lifted = reference.vertices.copy()
    lifted[0] += 0.1 * reference.face_normals[0]

    answer = refined(reference.moved_to(lifted), reference)

    before, after = answer.report.quality.input, answer.report.quality.refined
    assert after is not None
    assert after.point_to_surface.max <= 1.02 * before.point_to_surface.max + 1e-4
    assert answer.report.outcome in {"kept", "improved"}


def test_a_reference_returned_as_source_stays_to_the_byte() -> None:
    answer = refined(torus(), torus())

    assert answer.report.outcome == "indistinguishable"
    assert answer.data == file("s.obj", torus()).data


def together(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]),
    )


def errors(answer: Refinement, truth: Mesh) -> Floats:
    """Distance of each written vertex from where it belongs, (n,)."""
    return row_lengths(read_asset("s.obj", answer.data).vertices - truth.vertices)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("least", [0.75, 0.9])
def test_what_lies_over_a_hole_of_the_reference_stays(least: float, seed: int) -> None:
    ball = sphere(3)
    hole = ball.corners[:, :, 2].max(axis=1) > least
    source = noisy(ball, 0.01, seed)

    answer = refined(source, Mesh(ball.vertices, ball.faces[~hole]))

    before = row_lengths(source.vertices - ball.vertices)
    after = errors(answer, ball)
    assert answer.report.outcome == "improved"
    assert after.max() < 1.3 * before.max()
    assert after.mean() < 0.7 * before.mean()
    assert answer.report.quality.refined is not None
    assert answer.report.quality.refined.validity.self_intersections == 0


@pytest.mark.parametrize("seed", [1, 2])
def test_a_part_the_reference_lacks_keeps_its_shape(seed: int) -> None:
    ball, pipe = sphere(3), cylinder(12, 9, 0.15, 0.8)
    handle = pipe.moved_to(pipe.vertices + np.array([1.13, 0, 0]))
    truth = together(ball, handle)
    source = noisy(truth, 0.01, seed)

    answer = refined(source, ball)

    on_handle = np.arange(len(truth.vertices)) >= len(ball.vertices)
    before, after = row_lengths(source.vertices - truth.vertices), errors(answer, truth)
    assert answer.report.outcome == "improved"
    assert after[on_handle].max() < 1.1 * before[on_handle].max()
    assert after[~on_handle].mean() < 0.7 * before[~on_handle].mean()


def half(ball: Mesh) -> Mesh:
    upper = ball.faces[ball.corners[:, :, 2].mean(axis=1) > 0]
    used, faces = np.unique(upper, return_inverse=True)
    return Mesh(ball.vertices[used], faces.reshape(-1, 3))


@pytest.mark.parametrize("effort", ["fast", "best"])
def test_a_ball_of_two_stays_where_it_is(effort: str) -> None:
    ball = sphere(2)
    other = ball.moved_to(ball.vertices + np.array([2.5, 0, 0]))

    answer = refined(ball, together(ball, other), effort=effort)

    assert answer.report.outcome == "kept"
    assert answer.report.displacement.max == 0


@pytest.mark.parametrize("seed", [1, 2])
def test_half_a_ball_is_not_spread_over_the_whole(seed: int) -> None:
    truth = half(sphere(3))
    source = noisy(truth, 0.01, seed)

    answer = refined(source, sphere(3))

    before, after = row_lengths(source.vertices - truth.vertices), errors(answer, truth)
    assert answer.report.outcome == "improved"
    assert after.max() < before.max() + 0.1


def test_a_badge_of_most_vertices_stays_before_its_wall() -> None:
    wall, badge = sheet(6, 6), sheet(16, 16)
    badge = badge.moved_to(badge.vertices * [1 / 6, 1 / 6, 1] + [1, 1, 0.6])
    truth = together(wall, badge)
    source = noisy(truth, 0.01)

    answer = refined(source, wall)

    before, after = row_lengths(source.vertices - truth.vertices), errors(answer, truth)
    assert answer.report.outcome == "improved"
    assert after.max() <= 1.1 * before.max()


def test_a_ball_that_stays_outside_of_itself_is_not_moved() -> None:
    answer = refined(sphere(2), sphere(2), cones={"stay": "outside"})

    assert answer.report.outcome == "indistinguishable"
    assert answer.report.displacement.max == 0


@pytest.mark.parametrize(
    ("source", "options"),
    [
        (1.001, {"cones": {"edge_cap": {"times_input": 0.5}}}),
        (0.9, {"cones": {"stay": "outside"}, "surface": {"fairness": []}, "effort": "fast"}),
        (1000, {"cones": {"tolerance_band": {"relative": 0.1}}}),
    ],
    ids=["kept", "unchanged", "misaligned"],
)
def test_a_returned_input_that_breaks_a_constraint_is_told(
    source: float, options: dict[str, object]
) -> None:
    ball = sphere(2)

    answer = refined(ball.moved_to(source * ball.vertices), ball, **options)

    told = {warning.code: warning.words for warning in answer.report.warnings}
    [kind] = set(options["cones"]) & {"edge_cap", "stay", "tolerance_band"}
    assert answer.report.displacement.max == 0
    assert f"{kind} at " in told["solver.cones_unmet"]


def test_a_returned_input_that_satisfies_its_constraints_is_not_told_of_them() -> None:
    answer = refined(sphere(2), sphere(2), cones={"edge_cap": {"times_input": 1}})

    assert "solver.cones_unmet" not in {warning.code for warning in answer.report.warnings}


def tiles(count: int, size: tuple[float, float], height: float) -> Mesh:
    """Rectangles of two faces each, in a row over the plane z = 0."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    corners = [square * [*size, 1] + [0.4 + 0.9 * k, 1.5, height] for k in range(count)]
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return together(*(Mesh(corner, faces) for corner in corners))


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("sigma", [0.0002, 0.0014, 0.0042])
@pytest.mark.parametrize(
    ("size", "height"), [((0.5, 0.5), 0.0), ((0.6, 0.2), 0.0), ((0.5, 1.0), 0.004)]
)
def test_small_flat_pieces_on_a_large_face_keep_their_area(
    size: tuple[float, float], height: float, sigma: float, seed: int
) -> None:
    square = Mesh(
        np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    )
    pieces = tiles(4, size, height)
    reference = together(square, pieces)
    source = noisy(reference, sigma * np.sqrt(8), seed)

    answer = refined(source, reference)

    written = reference.moved_to(read_asset("s.obj", answer.data).vertices)
    kept = written.face_areas[2:].sum() / pieces.face_areas.sum()
    assert kept == pytest.approx(1, abs=0.03)
    before = row_lengths(source.vertices - reference.vertices)
    assert errors(answer, reference).mean() <= before.mean()


@pytest.mark.parametrize("seed", [1, 2])
def test_a_layer_over_a_curved_surface_keeps_its_border(seed: int) -> None:
    ball = sphere(3)
    patch = Mesh(1.002 * ball.vertices, ball.faces[ball.corners[:, :, 2].min(axis=1) > 0.7])
    used, faces = np.unique(patch.faces, return_inverse=True)
    truth = together(ball, Mesh(patch.vertices[used], faces.reshape(-1, 3)))
    source = noisy(truth, 0.004, seed)

    answer = refined(source, truth)

    before, after = row_lengths(source.vertices - truth.vertices), errors(answer, truth)
    assert answer.report.outcome == "improved"
    assert after.max() <= 1.1 * before.max()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_triangle_is_brought_to_its_plane_and_keeps_its_corners(seed: int) -> None:
    triangle = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]]))
    lifted = triangle.vertices.copy()
    lifted[:, 2] += np.random.default_rng(seed).uniform(0, 0.07, 3)

    answer = refined(triangle.moved_to(lifted), triangle)

    assert errors(answer, triangle).max() <= np.abs(lifted[:, 2]).max()


@pytest.mark.parametrize("effort", ["fast", "best"])
def test_a_pinned_vertex_stays_to_the_bit(effort: str) -> None:
    source = noisy(sphere(2), 0.02)

    answer = refined(source, sphere(3), effort=effort, cones={"pin": {"vertices": [0, 7, 100]}})

    written = read_asset("s.obj", answer.data).vertices
    sent = read_asset("s.obj", file("s.obj", source).data).vertices
    moved = (written != sent).any(axis=1)
    assert not moved[[0, 7, 100]].any()
    assert moved.sum() == len(moved) - 3
