"""What a round's fairness takes from the source: how rough it is, and up to which weight."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.program.cones import ToleranceBand
from meshcone.program.prepared_reference import PreparedReference, sample_count
from meshcone.program.source_structure import SourceStructure
from meshcone.surface import Mesh
from tests.meshes import sheet

NOISE_SCALE = 0.5
FLOOR = 1e-4


def lifted(height: float) -> tuple[Mesh, SourceStructure]:
    """A sheet of unit edges above a larger one, and its structure."""
    low = sheet(12, 12)
    middle = low.vertices[:, :2].mean(axis=0)
    high = sheet(5, 5)
    source = high.moved_to(high.vertices + np.array([*(middle - 2), height]))
    prepared = PreparedReference.of(low, len(source.vertices), seed=0)
    return source, SourceStructure.of(source, prepared, NOISE_SCALE)


def test_the_noisiness_is_the_squared_distance_over_the_length_of_edges() -> None:
    source, structure = lifted(0.3)
    centre = 12  # of its six edges two are diagonals
    length = (4 + 2 * np.sqrt(2)) / 6

    found = structure.noisiness[centre]

    assert source.vertices[centre, 2] == 0.3
    assert found == pytest.approx((0.3 / (NOISE_SCALE * length)) ** 2)


@pytest.mark.parametrize(
    ("weight", "share"),
    [(0.5, 0.2), (2.0, 0.1), (0.0, 0.0)],
    ids=["below the knee", "above it", "no weight"],
)
def test_fairness_acts_as_the_noisiness_and_above_the_knee_less(
    weight: float, share: float
) -> None:
    length = (4 + 2 * np.sqrt(2)) / 6
    source, structure = lifted(np.sqrt(0.2) * NOISE_SCALE * length)
    nobody = np.zeros(len(source.vertices), dtype=bool)
    up = np.broadcast_to([0.0, 0, 1], source.vertices.shape)

    fairness = structure.fairness(weight, 1.0, nobody, up)

    assert fairness.weights[12] == pytest.approx(weight * (share + FLOOR))


@pytest.mark.parametrize(("vertices", "samples"), [(10, 2000), (4000, 8000), (1_000_000, 290_000)])
def test_large_sources_have_fewer_samples_for_each_vertex(vertices: int, samples: int) -> None:
    assert sample_count(vertices) == samples


def test_a_band_is_as_tight_as_a_vertex_is_near_its_end() -> None:
    band = ToleranceBand(
        vertices=np.array([[0]]),
        points=np.zeros((1, 3)),
        normals=np.array([[0.0, 0, 1]]),
        half_width=0.1,
    )

    tight = [band.tightness(np.array([[0.0, 0, z]]))[0] for z in (0.0, 0.05, 0.1, 0.2)]

    assert tight == pytest.approx([-1.0, -0.5, 0.0, 0.5])
