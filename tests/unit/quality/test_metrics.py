"""Metrics against analytic values, other implementations, and their own invariants."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist, directed_hausdorff
from scipy.spatial.transform import Rotation

from meshcone.quality.metrics import SampledSurface, aspect_ratio, compare, earth_movers_distance
from meshcone.quality.records import Metrics
from meshcone.quality.validity import inspect
from meshcone.surface import Mesh
from tests.meshes import noisy, sheet, sphere, torus


def sampled(mesh: Mesh, seed: int = 0) -> SampledSurface:
    return SampledSurface.of(mesh, samples=2000, emd_samples=128, seed=seed)


def metrics(mesh: Mesh, reference: Mesh) -> Metrics:
    return compare(sampled(mesh, 0), sampled(reference, 1))


def test_a_mesh_lies_on_itself():
    found = metrics(torus(), torus())

    assert found.point_to_surface.max < 1e-9
    assert found.surface_normal_consistency == pytest.approx(1)


def test_concentric_spheres_are_as_far_apart_as_their_radii():
    inner, outer = sphere(4), sphere(4).moved_to(sphere(4).vertices * 1.1)

    found = metrics(inner, outer)

    assert found.point_to_surface.mean == pytest.approx(0.1, rel=0.01)
    assert found.point_to_surface.max == pytest.approx(0.1, rel=0.02)
    assert found.hausdorff >= found.point_to_surface.max
    assert found.fscore == 0


def test_hausdorff_and_chamfer_are_scipys():
    a, b = sampled(noisy(torus(), 0.05), 0), sampled(torus(), 1)

    found = compare(a, b)

    distances = cdist(a.samples.points, b.samples.points)
    chamfer = (distances.min(axis=0) ** 2).mean() + (distances.min(axis=1) ** 2).mean()
    hausdorff = max(
        directed_hausdorff(a.samples.points, b.samples.points)[0],
        directed_hausdorff(b.samples.points, a.samples.points)[0],
    )
    assert found.chamfer == pytest.approx(chamfer)
    assert found.hausdorff == pytest.approx(hausdorff)


def test_emd_of_a_translated_cloud_is_the_translation():
    points = np.random.default_rng(0).normal(size=(64, 3))

    assert earth_movers_distance(points, points + np.array([0.3, 0, 0])) == pytest.approx(0.3)


def test_emd_is_no_larger_than_any_matching():
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(64, 3)), rng.normal(size=(64, 3))
    squared_rows, squared_columns = linear_sum_assignment(cdist(a, b) ** 2)

    found = earth_movers_distance(a, b)

    assert found <= np.linalg.norm(a[squared_rows] - b[squared_columns], axis=1).mean()
    assert found <= np.linalg.norm(a - b, axis=1).mean()


def test_an_equilateral_triangle_has_aspect_ratio_one():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0]])

    found = aspect_ratio(Mesh(corners, np.array([[0, 1, 2]])))

    assert found.mean == pytest.approx(1)
    assert found.share_over_4 == 0


def test_a_face_without_area_counts_as_a_sliver_and_spoils_no_mean():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0], [2, 0, 0]])

    found = aspect_ratio(Mesh(corners, np.array([[0, 1, 2], [0, 1, 3]])))

    assert found.mean == pytest.approx(1)
    assert found.share_over_4 == 0.5


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.1, 10))
def test_metrics_do_not_see_rigid_motion_and_scale_with_the_mesh(seed: int, scale: float):
    rng = np.random.default_rng(seed)
    rotation, offset = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    source, reference = noisy(sphere(2), 0.05), sphere(2)

    def moved(mesh: Mesh) -> Mesh:
        return mesh.moved_to(scale * mesh.vertices @ rotation.T + offset)

    still, after = metrics(source, reference), metrics(moved(source), moved(reference))

    assert after.point_to_surface.mean == pytest.approx(scale * still.point_to_surface.mean)
    assert after.chamfer == pytest.approx(scale**2 * still.chamfer)
    assert after.emd == pytest.approx(scale * still.emd)
    assert after.normal_consistency == pytest.approx(still.normal_consistency)
    assert after.aspect_ratio.mean == pytest.approx(still.aspect_ratio.mean)


def test_a_torus_is_a_valid_surface():
    found = inspect(torus())

    assert found.watertight
    assert (found.boundary_edges, found.non_manifold_edges, found.components) == (0, 0, 1)


def test_a_sheet_has_the_boundary_it_shows():
    found = inspect(sheet(4, 6))

    assert not found.watertight
    assert found.boundary_edges == 2 * (3 + 5)


def test_defects_are_counted():
    mesh = sheet(3, 3)
    fin = np.array([[0, 4, 8]])
    broken = Mesh(mesh.vertices, np.concatenate([mesh.faces, mesh.faces[:1, [1, 2, 0]], fin]))

    found = inspect(broken)

    assert found.duplicate_faces == 1
    assert found.degenerate_faces == 1
    assert found.non_manifold_edges > 0
