from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from meshcone.threads import one_thread, use_one_thread


def test_the_numeric_libraries_are_asked_for_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    environment: dict[str, str] = {}
    monkeypatch.setattr("os.environ", environment)

    use_one_thread()

    assert environment["OPENBLAS_NUM_THREADS"] == environment["OMP_NUM_THREADS"] == "1"


def test_what_the_environment_asks_for_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    environment = {"OPENBLAS_NUM_THREADS": "4"}
    monkeypatch.setattr("os.environ", environment)

    use_one_thread()

    assert environment["OPENBLAS_NUM_THREADS"] == "4"


def threads_of_numpy() -> set[int]:
    np.ones((2, 2)) @ np.ones((2, 2))
    return {library["num_threads"] for library in threadpool_info()}


def test_libraries_that_are_loaded_use_one_thread_for_a_while(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("os.environ", {})

    with threadpool_limits(limits=2):
        before = threads_of_numpy()
        with one_thread():
            assert threads_of_numpy() == {1}
        assert threads_of_numpy() == before != {1}


def test_loaded_libraries_keep_the_threads_that_the_environment_asks_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("os.environ", {"OMP_NUM_THREADS": "2"})

    with threadpool_limits(limits=2):
        before = threads_of_numpy()
        with one_thread():
            assert threads_of_numpy() == before


def test_the_last_of_several_threads_gives_the_libraries_their_threads_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("os.environ", {})
    one, other = ExitStack(), ExitStack()

    with threadpool_limits(limits=2), ThreadPoolExecutor(1) as elsewhere:
        before = threads_of_numpy()
        one.enter_context(one_thread())
        elsewhere.submit(other.enter_context, one_thread()).result()
        one.close()
        while_one_is_in = elsewhere.submit(threads_of_numpy).result()
        elsewhere.submit(other.close).result()

        assert (while_one_is_in, threads_of_numpy()) == ({1}, before)
