"""Which share of a surface is farther away than a tolerance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshcone.quality.deviation.area import AreaShare, area_beyond
from meshcone.surface import Mesh
from tests.unit.quality.deviation.soups import distances, soup
from tests.unit.quality.deviation.test_interval import ball, grid, merged


def share(
    mesh: Mesh, reference: Mesh, tolerance: float, *bars: float, pieces: int = 50_000
) -> AreaShare:
    return area_beyond(mesh, reference, tolerance, bars, width=1e-3, most_pieces=pieces)


def uniform(mesh: Mesh, count: int, seed: int = 0) -> np.ndarray:
    """Points drawn by area."""
    random = np.random.default_rng(seed)
    faces = random.choice(len(mesh.faces), count, p=mesh.face_areas / mesh.face_areas.sum())
    weights = random.dirichlet([1, 1, 1], size=count)
    return np.asarray((weights[:, :, None] * mesh.corners[faces]).sum(axis=1))


def tilted() -> Mesh:
    """The unit square, lifted by as much as x is."""
    flat = grid(3)
    return flat.moved_to(flat.vertices + flat.vertices[:, :1] * [0, 0, 1])


def test_of_a_ramp_the_part_above_the_tolerance_is_beyond() -> None:
    """Over a wide plane the distance is the height, which grows evenly from 0 to 1."""
    plane = grid(1)
    wide = plane.moved_to(10 * (plane.vertices - [0.5, 0.5, 0]))
    found = share(tilted(), wide, 0.7)
    assert found.decided
    assert found.lower <= 0.3 + 1e-9
    assert found.upper >= 0.3 - 1e-9
    assert found.upper - found.lower <= 1e-3


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.05, 1.5))
def test_the_share_of_samples_is_inside_the_interval(seed: int, tolerance: float) -> None:
    mesh, reference = soup(seed, 5, "general"), soup(seed + 1, 6, "small and scattered")
    found = share(mesh, reference, tolerance, pieces=3000)
    sampled = float((distances(uniform(mesh, 2000), reference) > tolerance).mean())
    assert found.lower - 0.06 <= sampled <= found.upper + 0.06  # five standard errors


def test_one_part_of_two_is_beyond_as_a_whole() -> None:
    here, there = ball(2), ball(2)
    moved = there.moved_to(there.vertices + np.array([10.0, 0, 0]))
    found = share(merged(here, moved), here, 0.5)
    assert found.decided
    assert found.lower <= 0.5 <= found.upper


def test_nothing_of_a_mesh_on_itself_is_beyond() -> None:
    found = share(ball(2), ball(2), 1e-6)
    assert (found.lower, found.upper, found.decided) == (0, 0, True)


def test_a_bar_outside_the_interval_is_decided_at_once() -> None:
    early = share(ball(3, 1.5), ball(2), 0.05, 0.2, pieces=0)
    assert early.decided
    assert early.lower > 0.2


def test_pieces_that_run_out_leave_an_honest_interval() -> None:
    plane = grid(1)
    wide = plane.moved_to(10 * (plane.vertices - [0.5, 0.5, 0]))
    found = share(tilted(), wide, 0.5, pieces=0)
    assert not found.decided
    assert found.lower <= 0.5 <= found.upper


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scale_changes_rounding_only(scale: float) -> None:
    mesh, reference = tilted(), grid(4)
    first = share(mesh, reference, 0.055)
    larger, other = (each.moved_to(scale * each.vertices) for each in (mesh, reference))
    second = share(larger, other, 0.055 * scale)
    assert second.lower == pytest.approx(first.lower, abs=2e-3)
    assert second.upper == pytest.approx(first.upper, abs=2e-3)
