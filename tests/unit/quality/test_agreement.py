"""Our numbers beside those of other implementations, on the same samples."""

from __future__ import annotations

import pytest

from meshcone.quality.metrics import aspect_ratio, compare
from meshcone.quality.validity import inspect
from meshcone.surface import Mesh
from tests.independent import (
    aspect_ratio_by_vtk,
    earth_movers_distance,
    measure_independently,
)
from tests.meshes import cylinder, noisy, sheet, sphere, torus
from tests.unit.quality.measuring import sampled

TUBE = cylinder(sides=40, rings=20, radius=0.6, height=1.2)
PAIRS = [
    pytest.param(noisy(sphere(3), 0.02), sphere(4), id="ball"),
    pytest.param(noisy(torus(), 0.05), torus(30, 12), id="torus"),
    pytest.param(noisy(TUBE, 0.01), sphere(3), id="open tube in a ball"),
]


@pytest.mark.parametrize(("mesh", "reference"), PAIRS)
def test_distances_are_those_of_point_cloud_utils_and_vtk(mesh: Mesh, reference: Mesh) -> None:
    surface, other = sampled(mesh, 0), sampled(reference, 1)

    found = compare(surface, other, inspect(mesh, 0))

    theirs = measure_independently(surface, other)
    assert found.chamfer == pytest.approx(theirs.chamfer, rel=1e-9)
    assert found.chamfer_l1 == pytest.approx(theirs.chamfer_l1, rel=1e-9)
    assert found.hausdorff == pytest.approx(theirs.hausdorff, rel=1e-9)
    assert found.point_to_surface.mean == pytest.approx(theirs.point_to_surface_mean, rel=1e-6)
    assert found.point_to_surface.max >= theirs.vertex_hausdorff * (1 - 1e-9)
    assert found.aspect_ratio.mean == pytest.approx(theirs.aspect_ratio, rel=1e-6)


@pytest.mark.parametrize(("mesh", "reference"), PAIRS)
def test_the_earth_movers_distance_is_that_of_another_solver(mesh: Mesh, reference: Mesh) -> None:
    surface, other = sampled(mesh, 0), sampled(reference, 1)

    found = compare(surface, other, inspect(mesh, 0)).emd

    assert found == pytest.approx(earth_movers_distance(surface.matching, other.matching))


@pytest.mark.parametrize("mesh", [sheet(4, 9), noisy(sheet(9, 9), 0.2), torus(50, 5)])
def test_the_aspect_ratio_is_vtks(mesh: Mesh) -> None:
    assert aspect_ratio(mesh).mean == pytest.approx(aspect_ratio_by_vtk(mesh), rel=1e-6)
