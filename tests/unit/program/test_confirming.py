"""Asking SCS about an optimum that it did not find."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.options import Options, parse_options
from meshcone.program.answer import FinalProgram
from meshcone.program.confirm import confirm_optimum
from meshcone.program.conic import assemble, everything
from meshcone.program.records import record_round
from meshcone.program.round_solver import RoundSolution, slack_start
from meshcone.program.rounds import refine_surface
from meshcone.program.scs_solver import agreement
from tests.meshes import noisy, sphere

OPTIONS = Options().solver


@pytest.fixture(scope="module")
def final() -> FinalProgram:
    shape = sphere(2)
    unconfirmed = parse_options({"effort": "fast", "solver": {"certify": False}})
    found = refine_surface(noisy(shape, 0.02), shape, unconfirmed).final
    assert found is not None
    return found


def test_scs_agrees_at_an_optimum_before_its_first_iteration(final: FinalProgram):
    program = assemble(final.objective, everything(final.families))

    run = agreement(program, OPTIONS, slack_start(program, final.positions.ravel()))

    assert run is not None
    assert run.info.solved
    assert run.info.iterations == 0
    np.testing.assert_allclose(run.solution.x, final.positions.ravel(), atol=1e-4)


def test_scs_does_not_agree_beside_an_optimum(final: FinalProgram):
    program = assemble(final.objective, everything(final.families))

    assert agreement(program, OPTIONS, slack_start(program, final.positions.ravel() + 0.01)) is None


def test_scs_goes_on_where_it_does_not_agree(final: FinalProgram):
    beside = RoundSolution(final.positions + 0.01, (), "relaxation", 0)
    record = record_round(0, beside, final.families, final.before, 0.0)

    confirmed = confirm_optimum(final.objective, final.families, beside, record, OPTIONS)

    assert confirmed.info is not None
    assert confirmed.info.solved
    assert confirmed.info.iterations > 0
