"""A piece that the reference lacks stays as it is, however close to the reference it lies."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.options import parse_options
from meshcone.program.effort import candidates
from meshcone.program.rounds import refine_surface
from meshcone.program.surface_problem import SurfaceProblems
from meshcone.surface import Mesh
from tests.meshes import noisy, sphere, together

BALL = sphere(3)


def knob(x: float) -> Mesh:
    ball = sphere(1)
    return ball.moved_to(0.03 * ball.vertices + np.array([x, 0, 0]))


@pytest.mark.parametrize("effort", ["fast", "best"])
@pytest.mark.parametrize("sigma", [0.0, 0.002])
def test_a_knob_close_above_a_body_keeps_its_shape(sigma: float, effort: str) -> None:
    source = noisy(together(BALL, knob(1.04)), sigma)
    options = parse_options({"effort": effort, "solver": {"certify": False}})

    answer = refine_surface(source, BALL, options)

    ours = slice(len(BALL.vertices), None)
    np.testing.assert_allclose(answer.positions[ours], source.vertices[ours], atol=1e-9)
    assert answer.kept_because == () or sigma == 0


def test_mending_leaves_a_piece_of_which_no_vertex_lies_on_the_reference() -> None:
    dented = BALL.vertices.copy()
    dented[7] *= 0.9
    reference = together(BALL, knob(1.5))
    source = together(BALL.moved_to(dented), noisy(knob(1.5), 0.002))
    options = parse_options({})
    [mending] = [each for each in candidates(options) if each.name == "mending"]

    held = SurfaceProblems(source, reference, options).problem(mending).held

    assert held is not None
    assert np.flatnonzero(~held).tolist() == [7]
