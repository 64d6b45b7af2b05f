"""Which closed pieces of a surface face inwards though they are no cavities."""

from __future__ import annotations

import pytest
import trimesh

from meshcone.auditing.records.geometry import Geometry
from tests.unit.auditing.squares import audit_obj


def box(size: float, *at: float, inwards: bool = False) -> trimesh.Trimesh:
    """A cube with its middle at some place."""
    made = trimesh.creation.box((size, size, size))
    made.apply_translation(at or (0, 0, 0))
    if inwards:
        made.invert()
    return made


def geometry_of(*solids: trimesh.Trimesh) -> Geometry:
    """Of solids whose equal corners are one."""
    whole = trimesh.util.concatenate(solids)
    whole.merge_vertices()
    return audit_obj(whole.export(file_type="obj").encode()).geometry


@pytest.mark.parametrize("place", [(1.5, 1.5, 1.5), (1.5, 1.5, 0.5)])
def test_a_solid_that_touches_another_at_a_corner_or_an_edge_can_be_inside_out(
    place: tuple[float, float, float],
) -> None:
    found = geometry_of(box(2), box(1, *place, inwards=True))

    assert found.inside_out_share == pytest.approx(6 / 30)
    assert found.pieces == 1


def test_the_volume_of_solids_that_touch_at_a_corner_is_that_of_both() -> None:
    found = geometry_of(box(2), box(1, 1.5, 1.5, 1.5, inwards=True))

    assert found.volume == pytest.approx(8 + 1)


def test_a_solid_that_floats_in_a_cavity_can_be_inside_out() -> None:
    shell = box(10), box(8, inwards=True)

    assert geometry_of(*shell, box(1, inwards=True)).inside_out_share == pytest.approx(6 / 990)
    assert geometry_of(*shell, box(1)).inside_out_share == 0


def test_a_cavity_of_what_floats_in_a_cavity_is_one() -> None:
    found = geometry_of(box(10), box(8, inwards=True), box(4), box(2, inwards=True))

    assert found.inside_out_share == 0
    assert found.volume == pytest.approx(1000 - 512 + 64 - 8)


def test_a_cavity_that_touches_its_solid_at_a_corner_is_one() -> None:
    corners = [(2, 2, 2), (0, 1, 1), (1, 0, 1), (1, 1, 0)]
    cavity = trimesh.Trimesh(corners, [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)])
    cavity.fix_normals()
    cavity.invert()

    assert geometry_of(box(4), cavity).inside_out_share == 0


def test_a_cavity_far_from_the_origin_is_one() -> None:
    found = geometry_of(box(4, 1e6, 0, 0), box(2, 1e6, 0, 0, inwards=True))

    assert found.inside_out_share == 0
