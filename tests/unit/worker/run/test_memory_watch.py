from __future__ import annotations

import signal
from pathlib import Path

import pytest

from worker.run.horse import Death
from worker.run.memory_watch import MemoryWatch, oom_kills

MEGABYTE = 1_000_000
WATCH = MemoryWatch(limit=100 * MEGABYTE, held=150 * MEGABYTE, killed=oom_kills())


@pytest.mark.parametrize("number", [signal.SIGSEGV, signal.SIGABRT])
def test_native_code_that_dies_with_most_of_the_limit_in_use_lacked_memory(
    number: signal.Signals,
) -> None:
    assert WATCH.explains(Death(None, number, peak_memory=220 * MEGABYTE))


def test_native_code_that_dies_with_little_in_use_died_of_something_else() -> None:
    assert not WATCH.explains(Death(None, signal.SIGSEGV, peak_memory=170 * MEGABYTE))


def test_a_kill_says_nothing_of_memory() -> None:
    assert not WATCH.explains(Death(None, signal.SIGKILL, peak_memory=240 * MEGABYTE))


def test_without_a_limit_only_the_kernel_can_tell() -> None:
    unlimited = MemoryWatch(limit=0, held=0, killed=oom_kills())

    assert not unlimited.explains(Death(None, signal.SIGSEGV, peak_memory=900 * MEGABYTE))


def test_what_the_kernel_ended_since_is_a_lack_of_memory() -> None:
    before = MemoryWatch(limit=0, held=0, killed=oom_kills() - 1)

    assert before.explains(Death(None, signal.SIGKILL))


def test_the_kernels_count_is_read_from_the_process_own_group(tmp_path: Path) -> None:
    group = tmp_path / "sys" / "worker.slice"
    group.mkdir(parents=True)
    (group / "memory.events").write_text("low 0\nhigh 0\nmax 12\noom 2\noom_kill 2\n")
    membership = tmp_path / "cgroup"
    membership.write_text("1:name=old:/elsewhere\n0::/worker.slice\n")

    assert oom_kills(membership, tmp_path / "sys") == 2


def test_where_nobody_counts_there_are_none(tmp_path: Path) -> None:
    assert oom_kills(tmp_path / "missing") == 0
