"""Settings race, the better one finishes, and faces pull at the end."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.options import Options, parse_options
from meshcone.program.attempt import Attempt, Countdown
from meshcone.program.certificate import residuals
from meshcone.program.effort import candidates
from meshcone.program.rounds import refine_surface
from meshcone.program.surface_problem import SurfaceProblems
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from tests.meshes import noisy, sphere, torus

QUIET = {"solver": {"certify": False}}


def distance_both_ways(mesh: Mesh, reference: Mesh) -> float:
    one, other = (sample_surface(surface, 4096, seed=91).points for surface in (mesh, reference))
    there = SurfaceTree(reference).closest(one).distances.mean()
    back = SurfaceTree(mesh).closest(other).distances.mean()
    return float(there + back) / 2


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_faces_that_pull_bring_a_coarse_mesh_closer(seed: int) -> None:
    source, reference = noisy(sphere(2), 0.02, seed), sphere(4)
    with_pulls, without = (
        refine_surface(
            source,
            reference,
            parse_options({**QUIET, "effort": "fast", "surface": {"faces": faces}}),
        )
        for faces in (3.0, 0.0)
    )

    found, before = (
        distance_both_ways(source.moved_to(answer.positions), reference)
        for answer in (with_pulls, without)
    )
    assert found < 0.95 * before


def test_the_rounds_of_a_setting_that_falls_behind_are_not_solved() -> None:
    announced: list[tuple[int, int]] = []
    # Noise of twice the edges' length: without strong smoothing first there is no way back.
    source = noisy(torus(96, 48), 0.08)

    answer = refine_surface(
        source, torus(96, 48), parse_options(QUIET), lambda *done: announced.append(done)
    )

    schedules = {c.name: c.options.fairness for c in candidates(Options()) if c.is_always_tried}
    assert answer.candidate == "smoothing"
    assert len(answer.rounds) == len(schedules["smoothing"])
    total = sum(map(len, schedules.values()))
    assert announced[-1] == (total, total)
    assert len(announced) == total - len(schedules["pulling"]) + 3 + 1


def test_both_run_to_the_end_where_neither_is_ahead() -> None:
    announced: list[tuple[int, int]] = []
    # Where faces pull from the first round on, the race is over at the last.
    options = parse_options({**QUIET, "surface": {"faces_from": 0}})

    refine_surface(noisy(sphere(2), 0.01), sphere(3), options, lambda *done: announced.append(done))

    total = sum(len(c.options.fairness) for c in candidates(options) if c.is_always_tried)
    assert announced[-1] == (total, total)


def test_a_program_let_go_of_is_written_again_as_it_was() -> None:
    options = parse_options({"effort": "fast"})
    [setting] = candidates(options)
    problems = SurfaceProblems(noisy(sphere(2), 0.02), sphere(3), options)
    attempt = Attempt(setting.name, problems.problem(setting), options.solver)
    attempt.complete(Countdown(None, 5))

    kept = attempt.final()
    attempt.let_go()
    again = attempt.final()

    assert again is not kept
    assert again.round_index == kept.round_index == 4
    np.testing.assert_array_equal(again.objective.linear, kept.objective.linear)
    np.testing.assert_array_equal(again.positions, kept.positions)


def test_an_answer_that_harms_is_returned_only_unguarded() -> None:
    source, reference = sphere(3), torus(24, 12, tube=0.05)  # a ball has no hole to become a ring
    options = parse_options({**QUIET, "effort": "fast"})

    kept = refine_surface(source, reference, options)
    wreck = refine_surface(source, reference, options, guarded=False)

    np.testing.assert_array_equal(kept.positions, source.vertices)
    assert kept.kept_input
    assert kept.final is None
    assert not wreck.kept_input
    assert wreck.final is not None


def test_an_answer_whose_last_rounds_harm_is_that_of_an_earlier_round() -> None:
    # A ball of so many vertices has more of them than fit on a ring without folds.
    source, reference = sphere(3), torus(48, 24, tube=0.25)

    answer = refine_surface(source, reference, parse_options({**QUIET, "surface": {"guards": 0}}))

    schedule = next(c for c in candidates(Options()) if c.name == answer.candidate)
    assert not answer.kept_input
    assert len(answer.rounds) < len(schedule.options.fairness)
    assert answer.final is not None
    assert answer.final.round_index == len(answer.rounds) - 1
    refined = source.moved_to(answer.positions)
    assert distance_both_ways(refined, reference) < 0.5 * distance_both_ways(source, reference)


def test_an_answer_whose_last_rounds_lead_away_ends_where_it_raced() -> None:
    source, reference = noisy(sphere(2), 0.03), sphere(4)
    # Without samples that pull in the last rounds, vertices come to lie on the ball, and all that
    # is between them inside of it.
    options = parse_options({**QUIET, "surface": {"faces": 1e-3}})

    answer = refine_surface(source, reference, options)

    setting = next(c for c in candidates(options) if c.name == answer.candidate)
    assert len(answer.rounds) == setting.heat
    drifted = refine_surface(source, reference, options, guarded=False)
    assert len(drifted.rounds) == len(setting.options.fairness)
    found, away = (
        distance_both_ways(source.moved_to(a.positions), reference) for a in (answer, drifted)
    )
    assert found < 0.5 * away


def test_an_earlier_end_is_an_optimum_too() -> None:
    options = parse_options({"effort": "fast"})
    [setting] = candidates(options)
    problems = SurfaceProblems(noisy(sphere(2), 0.02), sphere(3), options)
    whole = Attempt(setting.name, problems.problem(setting), options.solver)
    whole.complete(Countdown(None, 5))

    shorter = whole.shortened(3)
    shorter.complete(Countdown(None, 3))
    final = shorter.final()

    assert final.round_index == 2
    assert [record.round for record in shorter.records] == [1, 2, 3]
    found = residuals(final.objective, final.families, final.positions, final.multipliers)
    assert found.worst < 1e-6


@pytest.mark.parametrize("rounds", [1, 3, 5])
def test_a_shorter_attempt_ends_where_one_of_so_many_rounds_does(rounds: int) -> None:
    options = parse_options({"effort": "fast"})
    [setting] = candidates(options)
    problem = SurfaceProblems(noisy(sphere(2), 0.02), sphere(3), options).problem(setting)
    whole, alone = (
        Attempt("", problem, options.solver),
        Attempt("", problem, options.solver, rounds=rounds),
    )
    whole.complete(Countdown(None, 5))

    shorter = whole.shortened(rounds)

    found, expected = (each.complete(Countdown(None, 5)).solution for each in (shorter, alone))
    np.testing.assert_allclose(found.positions, expected.positions, atol=1e-11)
    assert len(shorter.records) == len(alone.records) == rounds
