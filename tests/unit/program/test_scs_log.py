"""What is read of SCS's log of its iterations, whole or cut by a full disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from meshcone.program.scs_solver import read_history

HEAD = "iter,res_pri,res_dual,gap,pobj,dobj,scale,time,comp_spectral,\n"
FIRST = "0,1e-1,2e-1,3e-1,nan,5,0.1,1e-3,\n"
SECOND = "25,1e-9,2e-9,3e-9,4,5,0.1,2e-3,\n"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "iterations.csv"


def test_a_number_for_each_iteration_and_column(log: Path) -> None:
    log.write_text(HEAD + FIRST + SECOND)

    history = read_history(log)

    assert (history["iter"], history["gap"]) == ([0, 25], [0.3, 3e-9])


@pytest.mark.parametrize("length", [1, 8, len(SECOND) - 2, len(SECOND) - 1])
def test_a_last_row_that_is_cut_is_left_out(log: Path, length: int) -> None:
    log.write_text(HEAD + FIRST + SECOND[:length])

    assert read_history(log)["iter"] == [0]


def test_a_cut_row_in_the_middle_is_left_out(log: Path) -> None:
    log.write_text(HEAD + FIRST[:12] + SECOND + SECOND)

    assert read_history(log)["iter"] == [25]


@pytest.mark.parametrize("written", ["", HEAD[:20], HEAD[:20] + SECOND])
def test_a_log_without_its_head_says_nothing(log: Path, written: str) -> None:
    log.write_text(written)

    assert set(map(tuple, read_history(log).values())) == {()}


def test_a_log_that_could_not_be_made_says_nothing(log: Path) -> None:
    assert set(map(tuple, read_history(log).values())) == {()}
