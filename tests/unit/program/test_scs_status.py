"""What the end of a run of SCS means."""

from __future__ import annotations

from typing import Any

import pytest
import scs

from meshcone.errors import InfeasibleError, InternalError, SolveTimeoutError
from meshcone.options import SolverOptions
from meshcone.program.scs_solver import check_status, record_of

OPTIONS = SolverOptions(time_limit=7)


def ended(value: int, status: str) -> dict[str, Any]:
    return {"status_val": value, "status": status}


@pytest.mark.parametrize(
    ("value", "status"),
    [
        (scs.SOLVED, "solved"),
        (scs.SOLVED_INACCURATE, "solved (inaccurate - reached max_iters)"),
    ],
)
def test_a_run_that_is_solved_or_out_of_iterations_passes(value: int, status: str) -> None:
    check_status(ended(value, status), OPTIONS)


def test_a_run_that_was_out_of_time_says_how_much_it_had() -> None:
    info = ended(scs.SOLVED_INACCURATE, "solved (inaccurate - reached time_limit_secs)")

    with pytest.raises(SolveTimeoutError, match="within 7 s"):
        check_status(info, OPTIONS)


@pytest.mark.parametrize("value", [scs.INFEASIBLE, scs.INFEASIBLE_INACCURATE])
def test_an_infeasible_program_is_the_senders_to_mend(value: int) -> None:
    with pytest.raises(InfeasibleError, match="contradict each other"):
        check_status(ended(value, "infeasible"), OPTIONS)


@pytest.mark.parametrize("value", [scs.UNBOUNDED, scs.FAILED])
def test_any_other_end_is_a_failure_in_the_words_of_scs(value: int) -> None:
    with pytest.raises(InternalError, match="gave up: interrupted"):
        check_status(ended(value, "interrupted"), OPTIONS)


def test_a_record_has_seconds_and_objectives_with_the_constant() -> None:
    info = ended(scs.SOLVED, "solved") | {
        "iter": 12,
        "res_pri": 1e-7,
        "res_dual": 2e-7,
        "gap": 3e-7,
        "pobj": 4.0,
        "dobj": 3.5,
        "lin_sys_solver": "sparse-direct-amd-qdldl",
        "setup_time": 250.0,
        "solve_time": 1500.0,
    }

    record = record_of(info, constant=1.0)

    assert (record.solved, record.iterations) == (True, 12)
    assert (record.setup_seconds, record.solve_seconds) == (0.25, 1.5)
    assert (record.primal_objective, record.dual_objective) == (5.0, 4.5)
