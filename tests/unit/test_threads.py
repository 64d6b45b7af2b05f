from __future__ import annotations

import pytest

from meshcone.threads import use_one_thread


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
