"""Which faces are to blame for a distance from the reference."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.detail.misses import Misses, Target
from meshcone.surface import Mesh
from tests import shapes

SOURCE, REFERENCE = (Mesh(*shapes.sphere(level, 1.0)) for level in (2, 4))
TARGET = Target.of(REFERENCE, 0)


def test_the_distance_of_a_chord_is_its_sagitta() -> None:
    sides = Misses.of(SOURCE, TARGET).sides
    corners = SOURCE.corners
    halves = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2) / 2
    assert sides == pytest.approx(1 - np.sqrt(1 - halves**2), abs=2e-3)


def test_a_mesh_misses_itself_by_nothing() -> None:
    found = Misses.of(REFERENCE, TARGET)
    assert found.farthest < 1e-7
    assert found.total < 1e-12


def test_the_face_below_a_spike_is_to_blame_for_it() -> None:
    spiked = REFERENCE.vertices.copy()
    top = int(spiked[:, 2].argmax())
    spiked[top] *= 1.5
    found = Misses.of(SOURCE, Target.of(REFERENCE.moved_to(spiked), 0))
    assert SOURCE.corners[found.scores.argmax()].mean(axis=0)[2] > 0.8
    assert found.farthest == pytest.approx(0.5, abs=0.01)


def test_a_part_that_the_source_lacks_is_not_blamed_on_its_border() -> None:
    """Half a ball has no more to add at its rim for the half it lacks."""
    half = Mesh(SOURCE.vertices, SOURCE.faces[SOURCE.corners.mean(axis=1)[:, 2] > 0])
    found = Misses.of(half, TARGET)
    rim = half.border_sides.any(axis=1)
    assert found.farthest > 0.9
    assert found.scores[rim].max() < 10 * found.scores[~rim].max()


def test_a_hole_in_the_reference_is_blamed_on_no_face() -> None:
    kept = REFERENCE.faces[REFERENCE.corners.mean(axis=1)[:, 2] < 0.7]
    found = Misses.of(SOURCE, Target.of(Mesh(REFERENCE.vertices, kept), 0))
    over = SOURCE.corners.mean(axis=1)[:, 2] > 0.9
    assert found.scores[over].max() < 1.5 * found.scores[~over].max()
